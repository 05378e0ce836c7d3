// Constants that C++ and the shaders share: screen_space.cpp reads these very lines.
// Of the pyramid: its cells have edges of 2^level samples
const int kLevelStep = 2;
const int kLastLevel = 6;

// How a ray ends: the index of its count.
const int kHit = 0;
const int kSky = 1;           // it leaves the scene over the background
const int kOffscreen = 2;     // it leaves the frame
const int kBehind = 3;        // it passed behind a surface that the frame shows
const int kBackface = 4;      // it met the back of a surface that the frame shows
const int kTowardCamera = 5;  // it passes the eye's near plane
const int kSteps = 6;         // it took all of its steps
const int kBelow = 7;         // not an end: samples with a ray that would enter the surface
const int kViewColour = 8;    // likewise: hits on surfaces that reflect
const int kSecondHit = 9;     // likewise: hits on the second layer
const int kCounts = 10;
