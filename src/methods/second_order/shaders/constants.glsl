// What shaders and C++ share: shaders/constants.h reads these very lines.

// Images, and beside them texture units
const int kClustersBinding = 0;
const int kNormalsBinding = 1;
const int kDepthsBinding = 2;
const int kTableBinding = 3;
const int kDiffuseBinding = 4;
const int kColorImagesBinding = 5;
const int kObjectsBinding = 6;
const int kDepthImagesBinding = 6;
const int kCubeMapBinding = 7;
const int kLobeHorizonsBinding = 7;
const int kReflectionBinding = 8;
const int kTilesBinding = 9;
// Storage blocks
const int kCountsBinding = 1;
const int kFoundBinding = 2;

// The table of clusters: texels of each, and what they have
const int kTableTexels = 8;
const int kRowX = 0;       // rows X, Y, W of the camera
const int kHorizon = 3;    // horizon; depth above it times W
const int kPlace = 4;      // corner in the atlas, size
const int kMore = 5;       // layer; mirrored grid: right and top in the atlas, scale
const int kFlags = 6;
const int kRectangle = 7;  // of all clusters of the object, in samples
const int kCrossingFlag = 1;
const int kConcaveFlag = 2;

// Cluster of samples that Embree traces: nothing is searched.
const uint kTracedSample = 65535u;
// Probes in a row of what shaders/probes.frag writes
const int kProbesAcross = 256;

// Marks of a sample beside raster::MaskBit, counted on the CPU: of atomics llvmpipe loops over all
// lanes, of those that nobody takes, too.
const uint kMarkBridged = 64u;  // a ray ends over a depth edge
const uint kMarkLater = 128u;   // left to look_up.frag

// What few runs have is counted by atomics: rays, and samples with a ray.
const int kCountBelowHorizon = 0;
const int kCountSelf = 1;
const int kCountFaded = 2;
const int kCountSecond = 3;
