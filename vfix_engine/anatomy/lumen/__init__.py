"""The hollow organ: voxels inside its wall, centreline, curves along it, and made lumens."""
