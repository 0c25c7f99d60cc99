"""The application in a browser, served by trame on this machine alone. Importing this package imports no trame."""
