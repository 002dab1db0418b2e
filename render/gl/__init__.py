"""Offscreen OpenGL: context, framebuffers, shader programs, the camera."""
