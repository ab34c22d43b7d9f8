"""The networks of ObjectFolder 2.0's section 5.1 as rows of the table: trained on request, never shipped."""
