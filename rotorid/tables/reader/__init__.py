"""Any file as cells, numbers and names: text, workbooks, settings, units, complaints, writing."""
