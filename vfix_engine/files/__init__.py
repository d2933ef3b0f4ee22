"""Files of images, surfaces and frames: what each says, checked, in LPS mm."""
