"""Logs of columns: text, Parquet, MATLAB, spreadsheets; `palpate.logs.formats.open_table` opens one."""
