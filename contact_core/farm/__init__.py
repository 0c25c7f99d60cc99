"""The farm: many jobs, in worker processes of this machine or over Dask, each done once and placed atomically.

`batch.run_batch` is what `contact batch` calls. `kinds` are what it can run, `task` is what a worker does,
`workers` is where workers come from, `inputs` is how a change is seen, and `page` is the report.
"""
