"""The scene in front of the camera, as meshes and lights."""
