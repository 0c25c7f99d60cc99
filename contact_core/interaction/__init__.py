"""What an artist does with pointer and keys, once for every host: no toolkit, no window, no scene library.

A front end sends `events` with a `view`, and draws what `Interaction` says has changed: posed surfaces, the
overlay, the status. Tools are plugins (hook `contact_tools`).
"""
