// Shared with C++ by raster/constants.h: bits of masks (raster::MaskBit)
const uint kMaskEnvironment = 1u;    // mask.environment: environment look-up instead of the true surface
const uint kMaskDisoccluded = 2u;    // mask.disoccluded
const uint kMaskClamped = 4u;        // mask.clamped
const uint kMaskRetraced = 8u;       // mask.retraced
const uint kMaskBelowHorizon = 16u;  // mask.below_horizon: rays below the surface: by a bent normal, or folded up
const uint kMaskSky = 32u;           // mask.sky: rays that leave the scene; no fallback
const uint kMaskTransition = 256u;   // mask.transition: rays in the walls of a flat impostor
// Why a ray in screen space found nothing (screen_space)
const uint kMaskOffscreen = 512u;      // mask.offscreen
const uint kMaskBehind = 1024u;        // mask.behind
const uint kMaskBackface = 2048u;      // mask.backface
const uint kMaskTowardCamera = 4096u;  // mask.toward_camera
const uint kMaskSteps = 8192u;         // mask.steps
const uint kMaskViewColour = 16384u;   // mask.view_colour: no miss, but the hit surface reflects
const uint kMaskFallback = 32768u;     // mask.fallback: another method renders the sample
// 64 and 128 are for a method's own marks, which no layer shows.
