// What shaders and C++ share: shaders/constants.h reads these very lines.

// Texture units
const int kSampleNormalsUnit = 0;
const int kSampleDepthsUnit = 1;
const int kSampleObjectsUnit = 2;
const int kTableUnit = 3;
const int kListsUnit = 4;
const int kColorsUnit = 5;
const int kNormalsUnit = 6;
const int kCubeMapUnit = 7;
const int kDepthsUnit = 8;
const int kRowsUnit = 9;
const int kDomainsUnit = 10;
const int kPlaneColorsUnit = 11;
const int kPlaneNormalsUnit = 12;

// The table of impostors: texels of each, and what they have
const int kTableTexels = 10;
const int kPlane = 0;   // normal, minus offset
const int kRowU = 1;    // on the plane: u and v of a point
const int kRowV = 2;
const int kMore = 3;    // layer, way (kWay...), metres of a texel, 1 where it has normals
const int kRows = 4;    // rows u w, v w, g w, w of its camera
const int kWalls = 8;   // height of the transition walls, id of the object, side of the plane, metres at which rays begin
const int kTint = 9;    // of its reflection; steepest surface of one of several depth maps

// A member of a list is an impostor's index, and from this bit on how many depth maps of its object
// follow, if they are several
const int kViewsShift = 20;
// Shares of a ray's way above it: MapRays::at
const float kHidden = 3.0;

const int kWayQuad = 0;
const int kWayDepth = 1;
const int kWayBox = 2;     // a quad with transition walls
const int kWayShared = 3;  // one whose colour is in the environment map
const int kWayPlane = 4;   // an object's own plane, without walls

// Rays of a lobe, each a cone of its share of the lobe: as many as `traced` has by default
const int kLobeRays = 8;

// With `layers` above 1 a ray takes only those depth maps of its own reflector that face it: cosine of the angle. Ours
const float kSelfCosine = 0.5;

// Radiance from which a look-up shows a texel that half floats have clamped: their largest less 1 %
const float kClampedRadiance = 64848.0;

// What is known of each sample: marks of raster::MaskBit, then the work
const int kWorkShift = 16;
const uint kMarkSecond = 64u;  // a reflective impostor was hit, and the ray went on
