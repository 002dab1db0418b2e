"""The scene as meshes and lights, independent of OpenGL."""
