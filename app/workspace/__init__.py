"""What every tab of the page shares: the case, its surface in the scene, camera and slices."""
