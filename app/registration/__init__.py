"""Registrations: the document, its fit and errors, what it is measured with, and the plan that goes by it."""
