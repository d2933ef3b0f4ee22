"""The pictures of the docs: a DICOM folder of the shipped head, and a scripted session on the page that takes them."""
