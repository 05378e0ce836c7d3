// A ray in the image of a depth map's camera.
struct Projected {
  vec3 from;  // u, v and depth where it enters the camera's frustum, all 0..1
  vec3 to;    // where it leaves
  float tFrom;
  float tTo;
  float wFrom;
  float wTo;
};

// Clips a ray by the six planes of the camera whose table lines begin at `texel`; false: nothing is
// left.
bool projected(int texel, vec3 origin, vec3 direction, out Projected ray) {
  vec4 rowU = texelFetch(impostorTable, texel + kRows);
  vec4 rowV = texelFetch(impostorTable, texel + kRows + 1);
  vec4 rowG = texelFetch(impostorTable, texel + kRows + 2);
  vec4 rowW = texelFetch(impostorTable, texel + kRows + 3);
  vec4 o = vec4(origin, 1.0);
  vec4 start = vec4(dot(rowU, o), dot(rowV, o), dot(rowG, o), dot(rowW, o));
  vec4 step = vec4(dot(rowU.xyz, direction), dot(rowV.xyz, direction), dot(rowG.xyz, direction),
                   dot(rowW.xyz, direction));
  // All six are start + t step >= 0; u, v, g: and w minus them
  vec3 low = -start.xyz / step.xyz;
  vec3 high = -(start.www - start.xyz) / (step.www - step.xyz);
  float tFrom = 0.0;
  float tTo = 1e30;
  for (int i = 0; i < 3; ++i) {
    float s = step[i];
    if (s > 0.0) tFrom = max(tFrom, low[i]);
    if (s < 0.0) tTo = min(tTo, low[i]);
    if (s == 0.0 && start[i] < 0.0) tTo = -1.0;
    float h = step.w - s;
    if (h > 0.0) tFrom = max(tFrom, high[i]);
    if (h < 0.0) tTo = min(tTo, high[i]);
    if (h == 0.0 && start.w < start[i]) tTo = -1.0;
  }
  vec4 from = start + tFrom * step;
  vec4 to = start + tTo * step;
  ray = Projected(from.xyz / from.w, to.xyz / to.w, tFrom, tTo, from.w, to.w);
  return tFrom < tTo && tTo < 1e29 && from.w > 0.0 && to.w > 0.0;
}

// The distance along the ray at a share of its projection.
float distanceAt(Projected ray, float share) {
  float near = (1.0 - share) * ray.wTo;
  float far = share * ray.wFrom;
  return (ray.tFrom * near + ray.tTo * far) / (near + far);
}

// Where two segments of a plane meet, as a share of the first; 2 where they do not.
float crossing(vec2 a, vec2 b, vec2 p, vec2 q) {
  vec2 d = b - a;
  vec2 e = q - p;
  vec2 f = p - a;
  float det = d.x * e.y - d.y * e.x;
  float share = (f.x * e.y - f.y * e.x) / det;
  float other = (f.x * d.y - f.y * d.x) / det;
  const float slack = 1e-4;  // neighbouring segments leave no gap
  bool meet = det != 0.0 && share >= 0.0 && share <= 1.0 && other >= -slack && other <= 1.0 + slack;
  return meet ? share : 2.0;
}
