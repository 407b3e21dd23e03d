"""The worksheet: a page of this computer on which a whole balancing job is edited in its own files."""
