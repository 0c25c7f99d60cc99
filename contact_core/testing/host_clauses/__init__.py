"""The clauses of the host contract by what they are about; `host_contract.HostContract` is all of them."""
