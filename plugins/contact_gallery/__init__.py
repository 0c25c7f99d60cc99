"""Every figure of the paper as a script of this package's public interface, with picture and measures.

`contact gallery` runs them; `contact_gallery.figures` holds them, one module each. They are examples first: read
them.
"""
