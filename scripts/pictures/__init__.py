"""The pictures of the docs: a DICOM folder of the shipped head, and a walk through the page that takes them."""
