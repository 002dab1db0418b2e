"""Image effects: glare, rain, exposure and sensor."""
