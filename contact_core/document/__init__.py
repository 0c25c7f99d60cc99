"""The document: contacts as one immutable value without geometry, its schema, and files of contacts to share."""
