#include "scene/animate.h"

#include <algorithm>

namespace catoptric::scene {
namespace {

int componentsOf(Target target) {
  return target == Target::Rotation ? 4 : 3;
}

/// Where a moment lies between a channel's keys: `fraction` of the way from key `first` to the
/// next one. Outside the keys the nearest key holds, with fraction 0.
struct Span {
  std::size_t first = 0;
  float seconds = 0.0f;  ///< distance of the two keys; 0 outside
  float fraction = 0.0f;
};

Span spanAt(const std::vector<float>& times, double timeSeconds) {
  if (timeSeconds <= times.front()) return {0, 0.0f, 0.0f};
  if (timeSeconds >= times.back()) return {times.size() - 1, 0.0f, 0.0f};
  const auto next = std::upper_bound(times.begin(), times.end(), timeSeconds,
                                     [](double t, float key) { return t < key; });
  const std::size_t first = static_cast<std::size_t>(next - times.begin()) - 1;
  const double length = static_cast<double>(*next) - times[first];
  return {first, static_cast<float>(length),
          static_cast<float>((timeSeconds - times[first]) / length)};
}

/// One channel's value at a moment, `components` floats into `out`.
void evaluate(const AnimationChannel& channel, double timeSeconds, std::size_t components,
              float* out) {
  const Span span = spanAt(channel.times, timeSeconds);
  const bool cubic = channel.interpolation == Interpolation::CubicSpline;
  const std::size_t keySize = cubic ? 3 * components : components;
  const float* key = channel.values.data() + span.first * keySize;
  const float* value = cubic ? key + components : key;

  if (span.seconds == 0.0f || channel.interpolation == Interpolation::Step) {
    std::copy_n(value, components, out);
    return;
  }
  const float t = span.fraction;
  const float* next = key + keySize;
  if (cubic) {
    // Hermite spline of glTF 2.0, appendix C.5; tangents are per second.
    const float* outTangent = key + 2 * components;
    const float* inTangent = next;
    const float* nextValue = next + components;
    const float t2 = t * t;
    const float t3 = t2 * t;
    for (std::size_t c = 0; c < components; ++c) {
      out[c] = (2.0f * t3 - 3.0f * t2 + 1.0f) * value[c] +
               span.seconds * (t3 - 2.0f * t2 + t) * outTangent[c] +
               (3.0f * t2 - 2.0f * t3) * nextValue[c] + span.seconds * (t3 - t2) * inTangent[c];
    }
  } else if (channel.target == Target::Rotation) {
    // Spherical, the short way round.
    const Quat a(value[3], value[0], value[1], value[2]);
    const Quat b(next[3], next[0], next[1], next[2]);
    const Quat q = glm::slerp(a, b, t);
    out[0] = q.x;
    out[1] = q.y;
    out[2] = q.z;
    out[3] = q.w;
  } else {
    for (std::size_t c = 0; c < components; ++c) out[c] = value[c] + t * (next[c] - value[c]);
  }
}

Mat4 localMatrix(const Node& node, const Vec3& translation, const Quat& rotation,
                 const Vec3& scale) {
  if (node.hasMatrix) return node.matrix;
  Mat4 m = glm::mat4_cast(rotation);
  m[0] *= scale.x;
  m[1] *= scale.y;
  m[2] *= scale.z;
  m[3] = Vec4(translation, 1.0f);
  return m;
}

/// Transposed inverse of a matrix' 3x3 part, times the magnitude of its determinant: it takes
/// normals along, keeps their side under mirroring, and also exists where the inverse does not.
Mat3 normalMatrix(const Mat3& m) {
  const Mat3 cofactors(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1]));
  return glm::dot(m[0], cofactors[0]) < 0.0f ? -cofactors : cofactors;
}

Vec3 perpendicularTo(const Vec3& n) {
  const Vec3 axis = std::abs(n.x) < 0.5f ? Vec3(1, 0, 0) : Vec3(0, 1, 0);
  return glm::normalize(glm::cross(n, axis));
}

/// A transformed tangent, unit and perpendicular to its normal.
Vec3 tangentAt(const Vec3& direction, const Vec3& normal) {
  const Vec3 t = direction - normal * glm::dot(direction, normal);
  const float squared = glm::dot(t, t);
  return squared > 1e-30f && std::isfinite(squared) ? t / std::sqrt(squared)
                                                    : perpendicularTo(normal);
}

/// Unit normal under `matrix`; a matrix that flattens everything keeps the normal.
Vec3 normalAt(const Mat3& matrix, const Vec3& normal) {
  const Vec3 n = matrix * normal;
  const float largest = std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
  if (!(largest > 0.0f) || !std::isfinite(largest)) return normal;
  return glm::normalize(n / largest);  // scaled first: tiny scales must not underflow
}

/// Nodes that are animated themselves or below an animated node.
std::vector<bool> movingNodes(const Scene& scene) {
  std::vector<bool> moving(scene.nodes.size(), false);
  for (const AnimationChannel& channel : scene.animation) {
    if (channel.target != Target::Weights) moving[static_cast<std::size_t>(channel.node)] = true;
  }
  for (std::size_t i = 0; i < scene.nodes.size(); ++i) {
    const int parent = scene.nodes[i].parent;
    if (parent != kNone && moving[static_cast<std::size_t>(parent)]) moving[i] = true;
  }
  return moving;
}

bool skinned(const Scene& scene, const Object& object) {
  return object.node != kNone && scene.nodes[static_cast<std::size_t>(object.node)].skin != kNone &&
         !scene.meshes[static_cast<std::size_t>(object.mesh)].joints.empty();
}

/// The mesh with its morph targets applied; false when there is nothing to apply.
bool applyMorphTargets(const Mesh& mesh, const std::vector<float>& weights, WorldVertices& v) {
  bool applied = false;
  const std::size_t count = std::min(weights.size(), mesh.morphTargets.size());
  for (std::size_t t = 0; t < count; ++t) {
    const float w = weights[t];
    if (w == 0.0f) continue;
    applied = true;
    const MorphTarget& target = mesh.morphTargets[t];
    for (std::size_t i = 0; i < target.positions.size(); ++i) {
      v.positions[i] += w * target.positions[i];
    }
    for (std::size_t i = 0; i < target.normals.size(); ++i) v.normals[i] += w * target.normals[i];
    if (v.tangents.empty()) continue;
    for (std::size_t i = 0; i < target.tangents.size(); ++i) {
      v.tangents[i] += Vec4(w * target.tangents[i], 0.0f);
    }
  }
  if (applied) {
    for (std::size_t i = 0; i < v.normals.size(); ++i) {
      v.normals[i] = normalizedOr(v.normals[i], mesh.normals[i]);
    }
  }
  return applied;
}

}  // namespace

Pose poseAt(const Scene& scene, double timeSeconds) {
  struct Local {
    Vec3 translation;
    Quat rotation;
    Vec3 scale;
  };
  Pose pose;
  pose.timeSeconds = timeSeconds;
  std::vector<Local> locals;
  locals.reserve(scene.nodes.size());
  pose.morphWeights.reserve(scene.nodes.size());
  for (const Node& node : scene.nodes) {
    locals.push_back({node.translation, node.rotation, node.scale});
    pose.morphWeights.push_back(node.morphWeights);
  }

  for (const AnimationChannel& channel : scene.animation) {
    if (channel.times.empty()) continue;
    const auto node = static_cast<std::size_t>(channel.node);
    if (channel.target == Target::Weights) {
      std::vector<float>& weights = pose.morphWeights[node];
      const std::size_t perKey = channel.interpolation == Interpolation::CubicSpline ? 3 : 1;
      weights.resize(channel.values.size() / (channel.times.size() * perKey));
      if (!weights.empty()) evaluate(channel, timeSeconds, weights.size(), weights.data());
      continue;
    }
    float value[4] = {};
    evaluate(channel, timeSeconds, static_cast<std::size_t>(componentsOf(channel.target)), value);
    Local& local = locals[node];
    switch (channel.target) {
      case Target::Translation:
        local.translation = Vec3(value[0], value[1], value[2]);
        break;
      case Target::Scale:
        local.scale = Vec3(value[0], value[1], value[2]);
        break;
      case Target::Rotation: {
        // Splines leave the unit sphere between keys.
        const Quat q(value[3], value[0], value[1], value[2]);
        const float length = glm::length(q);
        local.rotation = length > 1e-6f ? q / length : Quat(1.0f, 0.0f, 0.0f, 0.0f);
        break;
      }
      case Target::Weights:
        break;
    }
  }

  // In double, so that far parents cost their children nothing. Parents stand before children.
  std::vector<glm::dmat4> fileFromNode(scene.nodes.size());
  pose.worldFromNode.resize(scene.nodes.size());
  for (std::size_t i = 0; i < scene.nodes.size(); ++i) {
    const Node& node = scene.nodes[i];
    fileFromNode[i] =
        glm::dmat4(localMatrix(node, locals[i].translation, locals[i].rotation, locals[i].scale));
    if (node.parent != kNone) {
      fileFromNode[i] = fileFromNode[static_cast<std::size_t>(node.parent)] * fileFromNode[i];
    }
    glm::dmat4 worldFromNode = fileFromNode[i];
    worldFromNode[3] -= glm::dvec4(scene.origin, 0.0);
    pose.worldFromNode[i] = Mat4(worldFromNode);
  }
  return pose;
}

std::vector<bool> deformingObjects(const Scene& scene) {
  const std::vector<bool> nodeMoves = movingNodes(scene);
  std::vector<bool> weightsMove(scene.nodes.size(), false);
  for (const AnimationChannel& channel : scene.animation) {
    if (channel.target == Target::Weights) {
      weightsMove[static_cast<std::size_t>(channel.node)] = true;
    }
  }
  std::vector<bool> deforming(scene.objects.size(), false);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    if (object.node == kNone) continue;
    const auto node = static_cast<std::size_t>(object.node);
    if (weightsMove[node] &&
        !scene.meshes[static_cast<std::size_t>(object.mesh)].morphTargets.empty()) {
      deforming[i] = true;
    }
    if (skinned(scene, object)) {
      const Skin& skin = scene.skins[static_cast<std::size_t>(scene.nodes[node].skin)];
      for (const int joint : skin.joints) {
        if (nodeMoves[static_cast<std::size_t>(joint)]) deforming[i] = true;
      }
    }
  }
  return deforming;
}

std::vector<bool> movingObjects(const Scene& scene) {
  const std::vector<bool> nodeMoves = movingNodes(scene);
  std::vector<bool> moving = deformingObjects(scene);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    // A skinned object follows its joints, not its node.
    if (object.node != kNone && !skinned(scene, object) &&
        nodeMoves[static_cast<std::size_t>(object.node)])
      moving[i] = true;
  }
  return moving;
}

Mat4 worldFromObject(const Scene& scene, const Object& object, const Pose& pose) {
  if (skinned(scene, object)) return Mat4(1.0f);
  const Mat4 worldFromNode = object.node == kNone
                                 ? glm::translate(Mat4(1.0f), Vec3(-scene.origin))
                                 : pose.worldFromNode[static_cast<std::size_t>(object.node)];
  return worldFromNode * object.nodeFromInstance;
}

WorldVertices worldVertices(const Scene& scene, const Object& object, const Pose& pose) {
  const Mesh& mesh = scene.meshes[static_cast<std::size_t>(object.mesh)];
  const std::size_t count = mesh.positions.size();
  WorldVertices result;
  result.positions = mesh.positions;
  result.normals = mesh.normals;
  result.tangents = mesh.tangents;
  const bool hasTangents = !result.tangents.empty();

  if (!mesh.morphTargets.empty() && object.node != kNone) {
    applyMorphTargets(mesh, pose.morphWeights[static_cast<std::size_t>(object.node)], result);
  }

  if (skinned(scene, object)) {
    const Skin& skin = scene.skins[static_cast<std::size_t>(
        scene.nodes[static_cast<std::size_t>(object.node)].skin)];
    std::vector<Mat4> worldFromBind(skin.joints.size());
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      worldFromBind[j] =
          pose.worldFromNode[static_cast<std::size_t>(skin.joints[j])] * skin.inverseBind[j];
    }
    for (std::size_t i = 0; i < count; ++i) {
      const glm::u16vec4 joints = mesh.joints[i];
      const Vec4 weights = mesh.weights[i];
      Mat4 m = worldFromBind[joints.x] * weights.x;
      for (int k = 1; k < 4; ++k) {
        if (weights[k] != 0.0f) m += worldFromBind[joints[k]] * weights[k];
      }
      const Mat3 linear(m);
      result.positions[i] = Vec3(m * Vec4(result.positions[i], 1.0f));
      result.normals[i] = normalAt(normalMatrix(linear), result.normals[i]);
      if (hasTangents) {
        const Vec4 t = result.tangents[i];
        result.tangents[i] = Vec4(tangentAt(linear * Vec3(t), result.normals[i]), t.w);
      }
      if (i == 0) result.flipWinding = glm::determinant(linear) < 0.0f;
    }
  } else {
    const Mat4 m = worldFromObject(scene, object, pose);
    const Mat3 linear(m);
    const Mat3 forNormals = normalMatrix(linear);
    result.flipWinding = glm::dot(linear[0], glm::cross(linear[1], linear[2])) < 0.0f;
    for (std::size_t i = 0; i < count; ++i) {
      result.positions[i] = Vec3(m * Vec4(result.positions[i], 1.0f));
      result.normals[i] = normalAt(forNormals, result.normals[i]);
    }
    for (std::size_t i = 0; i < result.tangents.size(); ++i) {
      const Vec4 t = result.tangents[i];
      result.tangents[i] = Vec4(tangentAt(linear * Vec3(t), result.normals[i]), t.w);
    }
  }

  // A mirrored surface has mirrored tangent frames: b = cross(N, t) * w changes its side.
  if (result.flipWinding) {
    for (Vec4& t : result.tangents) t.w = -t.w;
  }
  return result;
}

bool leavesNoArea(const glm::dmat3& m) {
  const glm::dvec3 none(0.0);
  return glm::cross(m[0], m[1]) == none && glm::cross(m[1], m[2]) == none &&
         glm::cross(m[2], m[0]) == none;
}

std::vector<Vec3> placesAtStart(const Scene& scene) {
  const Pose pose = poseAt(scene, 0.0);
  std::vector<Vec3> places;
  for (std::size_t o = 0; o < scene.objects.size(); ++o) {
    if (static_cast<int>(o) == scene.ground) continue;
    const std::vector<Vec3> own = worldVertices(scene, scene.objects[o], pose).positions;
    places.insert(places.end(), own.begin(), own.end());
  }
  return places;
}

Box3 boundsAtStart(const Scene& scene) {
  Box3 bounds;
  for (const Vec3& p : placesAtStart(scene)) bounds.extend(p);
  return bounds;
}

}  // namespace catoptric::scene
