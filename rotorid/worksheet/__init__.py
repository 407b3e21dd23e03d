"""The worksheet: a local page for a whole balancing job, over the files and workflows of the command line."""
