// Constants that C++ and shaders share: raster/constants.h reads these very lines.

// Bindings of uniform blocks
const int kFrameBlock = 0;
const int kMaterialBlock = 1;

// Texture units of surfaces and of what is looked up in any pass
const int kBaseTextureUnit = 0;
const int kNormalTextureUnit = 1;
const int kSpecularTextureUnit = 2;
const int kEmissiveTextureUnit = 3;
const int kEnvironmentUnit = 4;
const int kFirstPassUnit = 5;  // and up: free for passes that draw surfaces

// Bindings of the composite's images, and the unit of reflection tints
const int kDiffuseImage = 0;
const int kObjectImage = 1;
const int kReflectionImage = 2;
const int kNormalImage = 3;
const int kTintImage = 4;
const int kHighlightImage = 5;
const int kTintsUnit = 5;

// Attributes of the scene's vertices
const int kPositionAttribute = 0;
const int kNormalAttribute = 1;
const int kTangentAttribute = 2;
const int kUv0Attribute = 3;
const int kUv1Attribute = 4;
const int kColorAttribute = 5;
const int kBakeAttribute = 6;
const int kFirstPassAttribute = 7;  // and up: free for passes with attributes of their own

// Stencil values that classify samples (raster::SampleClass)
const int kClassBackground = 0;
const int kClassDiffuse = 1;
const int kClassPlanarMirror = 2;
const int kClassCurvedMirror = 3;
const int kClassGlossy = 4;

// s from here on is a reflection (scene/reflectance.h)
const float kReflectiveThreshold = 0.05f;

// Of bent normals (frame/shading.h)
const float kLeastElevation = 0.025f;
const float kElevationShare = 0.9f;

// Of normals of reflections in normal maps (frame/shading.h)
const float kFinerLevels = 2.0f;
