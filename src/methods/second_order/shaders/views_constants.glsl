// Shared by diffuse_views.cpp and the shaders of many views.
const int kViewBlock = 2;        // of uniform blocks
const int kViewAttribute = 7;    // of vertices of a compound draw: the number of their view
const int kCompoundViews = 128;  // of a compound draw: what a uniform block's least size of 16 KiB holds
const int kFrontDepthUnit = 5;   // of the texture with what lies in front
