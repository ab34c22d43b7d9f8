"""A folder of objects becomes ObjectFiles: rows, intake, stages, the unit of work, runners."""
