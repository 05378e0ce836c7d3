// The shading model of frame/shading.h, the GPU's half of its agreement: formulas in that order.
// Programs that include this file take their defines from SceneRaster::shadingDefines() and their
// resources from SceneRaster::bindShadingResources().
//   ENVIRONMENT   0 constant, 1 gradient, 2 latitude-longitude image
//   SKY           1 when the environment's irradiance or the ambient light reaches any vertex
//   LIGHT_COUNT   lights that are not baked; LIGHT_SUM their sum as an expression of x and n
#include "constants.glsl"

const float kPi = 3.14159265358979;

struct Light {
  vec4 positionRange;    // xyz position; w 1 / range, 0 for unlimited
  vec4 directionOuter;   // xyz where it shines to; w cosine of the outer cone angle
  vec4 intensityCone;    // rgb intensity; w 1 / max(1e-3, cosInner - cosOuter)
};

layout(std140, binding = kFrameBlock) uniform Frame {
  mat4 clipFromWorld;
  mat4 rayFromWindow;    // window coordinates to (position - eye), homogeneous
  vec4 eye;              // xyz; w spread of one sample's ray cone in radians
  vec4 ambient;          // rgb radiance; w upper limit of radiance written
  vec4 environment[3];   // colour, horizon, ground: scale applied; [0].w front side's sign
  vec4 environmentTurn;  // cosine and sine of the rotation, scale
  vec4 irradianceSh[9];  // c_k times the constant factor of Y_k
#if LIGHT_COUNT > 0
  Light lights[LIGHT_COUNT];
#endif
} frame;

#if ENVIRONMENT == 2
layout(binding = kEnvironmentUnit) uniform sampler2D environmentImage;
#endif

// Radiance of the environment along the unit direction d.
vec3 environmentRadiance(vec3 d) {
#if ENVIRONMENT == 2
  // d turned by -rotation about +y, then the image's mapping
  vec2 turn = frame.environmentTurn.xy;
  vec3 e = vec3(turn.x * d.x - turn.y * d.z, d.y, turn.y * d.x + turn.x * d.z);
  float u = 0.5 + atan(e.x, -e.z) / (2.0 * kPi);
  float v = acos(clamp(e.y, -1.0, 1.0)) / kPi;
  return textureLod(environmentImage, vec2(u, v), 0.0).rgb * frame.environmentTurn.z;
#elif ENVIRONMENT == 1
  return mix(frame.environment[1].rgb,
             d.y >= 0.0 ? frame.environment[0].rgb : frame.environment[2].rgb, abs(d.y));
#else
  return frame.environment[0].rgb;
#endif
}

// Irradiance of the environment on a surface with unit normal n [Ramamoorthi2001].
vec3 skyIrradiance(vec3 n) {
  vec3 e = frame.irradianceSh[0].rgb + frame.irradianceSh[1].rgb * n.y +
           frame.irradianceSh[2].rgb * n.z + frame.irradianceSh[3].rgb * n.x +
           frame.irradianceSh[4].rgb * (n.x * n.y) + frame.irradianceSh[5].rgb * (n.y * n.z) +
           frame.irradianceSh[6].rgb * (3.0 * n.z * n.z - 1.0) +
           frame.irradianceSh[7].rgb * (n.x * n.z) +
           frame.irradianceSh[8].rgb * (n.x * n.x - n.y * n.y);
  return max(e, vec3(0.0));
}

#if LIGHT_COUNT > 0
vec3 directionalLight(int i, vec3 n) {
  return frame.lights[i].intensityCone.rgb * max(0.0, dot(n, -frame.lights[i].directionOuter.xyz));
}
vec3 pointLight(int i, vec3 x, vec3 n) {
  vec3 toLight = frame.lights[i].positionRange.xyz - x;
  float r2 = dot(toLight, toLight);
  float cosine = max(0.0, dot(n, toLight) * inversesqrt(max(r2, 1e-20)));
  float q = r2 * frame.lights[i].positionRange.w * frame.lights[i].positionRange.w;
  return min(frame.lights[i].intensityCone.rgb *
                 (cosine / max(r2, 1e-12) * clamp(1.0 - q * q, 0.0, 1.0)),
             vec3(1e30));
}
vec3 spotLight(int i, vec3 x, vec3 n) {
  vec3 toLight = frame.lights[i].positionRange.xyz - x;
  float cosine = dot(-toLight, frame.lights[i].directionOuter.xyz) *
                 inversesqrt(max(dot(toLight, toLight), 1e-20));
  float cone = clamp((cosine - frame.lights[i].directionOuter.w) * frame.lights[i].intensityCone.w,
                     0.0, 1.0);
  return pointLight(i, x, n) * (cone * cone);
}
#endif

// Irradiance at x of the lights that are not baked.
vec3 lightIrradiance(vec3 x, vec3 n) {
#if LIGHT_COUNT > 0
  return LIGHT_SUM;
#else
  return vec3(0.0);
#endif
}

// s of a metallic-roughness texel. lobe: of roughness 0 (lobe.glsl).
float specularLevel(float metallic, vec3 dielectricF0, float lobe) {
  float s = metallic + (1.0 - metallic) * max(max(dielectricF0.x, dielectricF0.y), dielectricF0.z);
  return lobe < 2.0 && s < kReflectiveThreshold ? 0.0 : s;
}

// Mip level of a texture whose texels are seen `texels` = sqrt(texels2) to a cone's width.
float textureLevel(float texels2, float last) {
  return clamp(0.5 * log2(max(1e-16, texels2)), 0.0, last);
}
