// A sample of the G-buffer without a surface: radiance of the environment, and -1 instead of an s.
//   TINT_OUTPUT, HIGHLIGHT_OUTPUT, LOBE_HORIZON_OUTPUT  1: as in gbuffer.frag
#include "environment.glsl"

layout(location = 0) out vec4 outDiffuse;
layout(location = 1) out vec4 outNormal;
layout(location = 2) out uint outObject;
#if TINT_OUTPUT
layout(location = 3) out vec4 outTint;
#endif
#if HIGHLIGHT_OUTPUT
layout(location = 3 + TINT_OUTPUT) out vec4 outHighlight;
#endif
#if LOBE_HORIZON_OUTPUT
layout(location = 3 + TINT_OUTPUT + HIGHLIGHT_OUTPUT) out uint outLobeHorizon;
#endif

void main() {
  outDiffuse = vec4(environmentSeen(), -1.0);
  outNormal = vec4(0.0);
  outObject = 0u;
#if TINT_OUTPUT
  outTint = vec4(1.0);
#endif
#if HIGHLIGHT_OUTPUT
  outHighlight = vec4(0.0);
#endif
#if LOBE_HORIZON_OUTPUT
  outLobeHorizon = 0u;
#endif
}
