"""The figures and tables of Mesit & Guha (2011), and what becomes of their statements."""
