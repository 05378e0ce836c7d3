// The alpha of the G-buffer's normals: g, or -1 - g where the normal was bent (raster::glossinessOf).
float glossOf(float alpha) { return alpha < 0.0 ? -1.0 - alpha : alpha; }
bool isBent(float alpha) { return alpha < 0.0; }
