// Shared by virtual_draw.cpp and the shaders of virtual objects.
const int kImageAttribute = 7;
const int kPlaceAttribute = 8;
const int kReflectorUnit = 5;
const int kDepthUnit = 6;
