// Constants that C++ and shaders share: shaders/constants.h reads these very lines.

// Texture units: those of the surfaces' shading come before (raster/shaders/constants.glsl)
const int kNormalsUnit = 5;
const int kDepthsUnit = 6;
const int kNodesUnit = 7;
const int kQuadsUnit = 8;
const int kVerticesUnit = 9;
const int kChartsUnit = 10;
const int kRadianceUnit = 11;

// Storage block of counts, and its members
const int kCountsBinding = 0;
const int kCountRays = 0;
const int kCountMisses = 1;
const int kCountBelowHorizon = 2;
const int kCountVisits = 3;
const int kCountQuads = 4;
const int kCountStopped = 5;
const int kCounts = 6;

// Exponent above which a lobe is sharp [Yu2008, section 4], rays and alpha of sharp ones, of others
const float kSharpExponent = 3000.0f;
const int kSharpRays = 20;
const float kSharpAlpha = 3.0f;
const int kBroadRays = 40;
const float kBroadAlpha = 10.0f;

// At or below this g a surface is a mirror (scene/reflectance.h)
const float kMirrorGlossiness = 0.05f;
