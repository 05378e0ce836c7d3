// The node graph and what hangs on it: objects, instances, skins, lights, cameras.
#include <algorithm>
#include <cmath>
#include <set>

#include "scene/gltf/reader.h"

namespace catoptric::scene::gltf {
namespace {

/// How far a rotation's length may be from 1 before it is an error; exporters round. Ours.
constexpr float kUnitTolerance = 1e-2f;

/// A matrix from 16 column-major numbers; glTF needs it affine.
Mat4 affineMatrix(const Reader& reader, const float* values, const std::string& place) {
  Mat4 m(1.0f);
  for (int i = 0; i < 16; ++i) m[i / 4][i % 4] = values[i];
  if (m[0][3] != 0.0f || m[1][3] != 0.0f || m[2][3] != 0.0f || m[3][3] != 1.0f) {
    reader.fail(place, "the last row of the matrix must be 0 0 0 1");
  }
  return m;
}

std::vector<float> asFloats(const std::vector<double>& values) {
  std::vector<float> result;
  result.reserve(values.size());
  for (const double v : values) result.push_back(static_cast<float>(v));
  return result;
}

Node readNode(const Reader& reader, std::size_t index) {
  const tinygltf::Node& source = reader.model.nodes[index];
  const std::string place = elementPlace("nodes", index);
  Node node;
  node.name = source.name.empty() ? "node " + std::to_string(index) : source.name;
  node.skin = source.skin;
  if (!source.matrix.empty()) {
    node.hasMatrix = true;
    node.matrix = affineMatrix(reader, asFloats(source.matrix).data(), place + "/matrix");
  }
  const auto vec3 = [](const std::vector<double>& v) {
    return Vec3(static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]));
  };
  if (!source.translation.empty()) node.translation = vec3(source.translation);
  if (!source.scale.empty()) node.scale = vec3(source.scale);
  if (!source.rotation.empty()) {
    const std::vector<float> r = asFloats(source.rotation);
    node.rotation = unitRotation(reader, r[0], r[1], r[2], r[3], place + "/rotation");
  }

  if (source.mesh < 0) {
    if (!source.weights.empty()) reader.fail(place + "/weights", "given without a mesh");
    return node;
  }
  const tinygltf::Mesh& mesh = reader.model.meshes[size(source.mesh)];
  const std::size_t targets = mesh.primitives.front().targets.size();
  if (!source.weights.empty() && source.weights.size() != targets) {
    reader.fail(place + "/weights", "has " + std::to_string(source.weights.size()) +
                                        " numbers, the mesh has " + std::to_string(targets) +
                                        " morph targets");
  }
  node.morphWeights = asFloats(!source.weights.empty() ? source.weights : mesh.weights);
  node.morphWeights.resize(targets, 0.0f);
  return node;
}

/// Places of one instance (EXT_mesh_gpu_instancing), or one identity without the extension.
std::vector<Mat4> readInstances(Reader& reader, const tinygltf::Node& node,
                                const std::string& place) {
  const tinygltf::Value& instancing = extension(node.extensions, "EXT_mesh_gpu_instancing");
  if (!instancing.IsObject()) return {Mat4(1.0f)};
  const tinygltf::Value& attributes = member(instancing, "attributes");
  const std::string base = place + "/extensions/EXT_mesh_gpu_instancing/attributes";

  std::size_t count = 0;
  std::string first;
  const auto accessorOf = [&](const char* name) {
    const tinygltf::Value& value = member(attributes, name);
    if (!value.IsInt()) return kNone;
    const int accessor = value.GetNumberAsInt();
    if (first.empty()) {
      first = name;
      count = reader.countOf(accessor);
    } else if (reader.countOf(accessor) != count) {
      reader.fail(base + "/" + name, "has " + std::to_string(reader.countOf(accessor)) +
                                         " elements, " + first + " has " + std::to_string(count));
    }
    return accessor;
  };
  const int translation = accessorOf("TRANSLATION");
  const int rotation = accessorOf("ROTATION");
  const int scale = accessorOf("SCALE");
  if (first.empty()) reader.fail(base, "has none of TRANSLATION, ROTATION, SCALE");

  reader.reserveBytes(count * (sizeof(Mat4) + sizeof(Object)), base);
  std::vector<Mat4> instances(count, Mat4(1.0f));
  if (rotation != kNone) {
    const std::vector<Vec4> values = reader.vectors<Vec4>(
        rotation, kFloat | kByteNormalized | kShortNormalized, base + "/ROTATION");
    for (std::size_t i = 0; i < count; ++i) {
      const Vec4 q = values[i];
      instances[i] = glm::mat4_cast(unitRotation(reader, q.x, q.y, q.z, q.w, base + "/ROTATION"));
    }
  }
  if (scale != kNone) {
    const std::vector<Vec3> values = reader.vectors<Vec3>(scale, kFloat, base + "/SCALE");
    for (std::size_t i = 0; i < count; ++i) {
      for (int axis = 0; axis < 3; ++axis) instances[i][axis] *= values[i][axis];
    }
  }
  if (translation != kNone) {
    const std::vector<Vec3> values =
        reader.vectors<Vec3>(translation, kFloat, base + "/TRANSLATION");
    for (std::size_t i = 0; i < count; ++i) instances[i][3] = Vec4(values[i], 1.0f);
  }
  return instances;
}

}  // namespace

Quat unitRotation(const Reader& reader, float x, float y, float z, float w,
                  const std::string& place) {
  const Quat q(w, x, y, z);
  const float length = glm::length(q);
  if (!(std::abs(length - 1.0f) <= kUnitTolerance)) {
    reader.fail(place, "the rotation has length " + std::to_string(length) + ", must be 1");
  }
  // What is unit up to rounding stays as it is.
  return std::abs(length - 1.0f) < 1e-6f ? q : q / length;
}

namespace {

/// Every node has at most one parent.
std::vector<int> parentsOf(const Reader& reader) {
  const std::vector<tinygltf::Node>& sources = reader.model.nodes;
  std::vector<int> parent(sources.size(), kNone);
  for (std::size_t i = 0; i < sources.size(); ++i) {
    for (std::size_t c = 0; c < sources[i].children.size(); ++c) {
      const int child = sources[i].children[c];
      const std::string place = elementPlace("nodes", i) + "/children/" + std::to_string(c);
      if (size(child) == i) reader.fail(place, "node " + std::to_string(i) + " is its own child");
      if (parent[size(child)] != kNone) {
        reader.fail(place, "node " + std::to_string(child) + " is a child of node " +
                               std::to_string(parent[size(child)]) + " already");
      }
      parent[size(child)] = static_cast<int>(i);
    }
  }
  return parent;
}

/// What the default scene lists.
struct Listed {
  std::vector<int> roots;
  std::vector<int> children;  ///< which should not be listed
};

Listed listedNodes(Reader& reader, const std::vector<int>& parent) {
  Listed listed;
  const std::vector<tinygltf::Scene>& scenes = reader.model.scenes;
  if (scenes.empty()) return listed;
  const int chosen = std::max(0, reader.model.defaultScene);
  const std::vector<int>& nodes = scenes[size(chosen)].nodes;
  std::set<int> seen;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::string place = elementPlace("scenes", size(chosen)) + "/nodes/" + std::to_string(i);
    if (!seen.insert(nodes[i]).second)
      reader.fail(place, "node " + std::to_string(nodes[i]) + " is listed twice");
    const int above = parent[size(nodes[i])];
    (above == kNone ? listed.roots : listed.children).push_back(nodes[i]);
    if (above != kNone && listed.children.size() == 1)
      reader.scene.warnings.push_back(reader.file + ": " + place + ": node " +
                                      std::to_string(nodes[i]) + " is not a root but child of " +
                                      std::to_string(above) +
                                      "; such nodes are drawn once, where their parents put them");
  }
  if (scenes.size() > 1)
    reader.scene.notes.push_back("of " + std::to_string(scenes.size()) + " scenes, scene " +
                                 std::to_string(chosen) + " is loaded");
  return listed;
}

}  // namespace

NodeOrder readNodes(Reader& reader) {
  const std::vector<tinygltf::Node>& sources = reader.model.nodes;
  const std::size_t count = sources.size();
  const std::vector<int> parent = parentsOf(reader);
  const Listed listed = listedNodes(reader, parent);

  NodeOrder order;
  order.sceneFromFile.assign(count, kNone);
  order.inScene.assign(count, false);
  // Depth first with a stack of our own: hostile files nest deeper than ours would bear.
  const auto visit = [&](int root, const auto& isNew) {
    std::vector<int> stack{root};
    while (!stack.empty()) {
      const int file = stack.back();
      stack.pop_back();
      if (!isNew(file)) continue;
      const std::vector<int>& children = sources[size(file)].children;
      stack.insert(stack.end(), children.rbegin(), children.rend());
    }
  };
  const auto add = [&](int root, bool inScene) {
    visit(root, [&](int file) {
      if (order.sceneFromFile[size(file)] != kNone) return false;
      order.sceneFromFile[size(file)] = static_cast<int>(order.fileFromScene.size());
      order.fileFromScene.push_back(file);
      order.inScene[size(file)] = inScene;
      return true;
    });
  };

  // The default scene's roots first; what is in no scene is kept for skins, but not drawn.
  for (const int root : listed.roots) add(root, true);
  for (std::size_t i = 0; i < count; ++i)
    if (parent[i] == kNone) add(static_cast<int>(i), reader.model.scenes.empty());
  for (const int child : listed.children)
    visit(child, [&](int file) {
      if (order.inScene[size(file)]) return false;
      order.inScene[size(file)] = true;
      return true;
    });
  // What no root reaches lies on a cycle.
  for (std::size_t i = 0; i < count; ++i) {
    if (order.sceneFromFile[i] == kNone) {
      reader.fail(elementPlace("nodes", i), "is part of a cycle of children");
    }
  }

  reader.reserveBytes(count * sizeof(Node), "/nodes");
  reader.scene.nodes.reserve(count);
  for (const int file : order.fileFromScene) {
    Node node = readNode(reader, size(file));
    if (parent[size(file)] != kNone) {
      node.parent = order.sceneFromFile[size(parent[size(file)])];
    }
    reader.scene.nodes.push_back(std::move(node));
  }
  return order;
}

void readSkins(Reader& reader, const NodeOrder& order) {
  for (std::size_t s = 0; s < reader.model.skins.size(); ++s) {
    const tinygltf::Skin& source = reader.model.skins[s];
    const std::string place = elementPlace("skins", s);
    Skin skin;
    std::set<int> seen;
    for (const int joint : source.joints) {
      if (!seen.insert(joint).second) {
        reader.fail(place + "/joints", "node " + std::to_string(joint) + " is listed twice");
      }
      skin.joints.push_back(order.sceneFromFile[size(joint)]);
    }
    skin.inverseBind.assign(skin.joints.size(), Mat4(1.0f));
    if (source.inverseBindMatrices >= 0) {
      const std::string own = place + "/inverseBindMatrices";
      if (reader.countOf(source.inverseBindMatrices) < skin.joints.size()) {
        reader.fail(own, "has " + std::to_string(reader.countOf(source.inverseBindMatrices)) +
                             " matrices, the skin has " + std::to_string(skin.joints.size()) +
                             " joints");
      }
      const std::vector<float> values = reader.floats(source.inverseBindMatrices, 16, kFloat, own);
      for (std::size_t j = 0; j < skin.joints.size(); ++j) {
        skin.inverseBind[j] = affineMatrix(reader, values.data() + j * 16, own);
      }
    }
    reader.scene.skins.push_back(std::move(skin));
  }
}

namespace {

/// Per mesh of the file and primitive.
struct DrawnMeshes {
  std::vector<std::vector<int>> mesh;  ///< in the scene; kNone: not drawn
  std::vector<std::vector<int>> material;
  std::vector<std::vector<int>> largestJoint;
};

/// Meshes in the order of the file, as far as they are drawn.
DrawnMeshes takeMeshes(Reader& reader, std::vector<std::vector<Primitive>> primitives) {
  Scene& scene = reader.scene;
  const int defaultMaterial = static_cast<int>(reader.model.materials.size());
  DrawnMeshes drawn;
  drawn.mesh.resize(primitives.size());
  drawn.material.resize(primitives.size());
  drawn.largestJoint.resize(primitives.size());
  for (std::size_t m = 0; m < primitives.size(); ++m) {
    for (Primitive& primitive : primitives[m]) {
      scene.notes.insert(scene.notes.end(), primitive.notes.begin(), primitive.notes.end());
      int joint = kNone;
      for (const glm::u16vec4& j : primitive.mesh.joints) {
        joint = std::max({joint, static_cast<int>(j.x), static_cast<int>(j.y),
                          static_cast<int>(j.z), static_cast<int>(j.w)});
      }
      drawn.largestJoint[m].push_back(joint);
      drawn.material[m].push_back(primitive.material == kNone ? defaultMaterial
                                                              : primitive.material);
      drawn.mesh[m].push_back(primitive.drawn ? static_cast<int>(scene.meshes.size()) : kNone);
      if (primitive.drawn) scene.meshes.push_back(std::move(primitive.mesh));
    }
  }
  return drawn;
}

/// Fails where a primitive's vertices name joints that its node's skin does not have.
void checkJoints(const Reader& reader, const tinygltf::Node& node, std::size_t primitive,
                 int largestJoint) {
  if (node.skin < 0) return;
  const auto joints = static_cast<int>(reader.scene.skins[size(node.skin)].joints.size());
  if (largestJoint < joints) return;
  reader.fail(elementPlace("meshes", size(node.mesh)) + "/primitives/" + std::to_string(primitive) +
                  "/attributes/JOINTS_0",
              "joint " + std::to_string(largestJoint) + " is out of range: /skins/" +
                  std::to_string(node.skin) + " has " + std::to_string(joints) + " joints");
}

/// A node's own s, g, n: a copy of each material that its primitives have.
int ownMaterial(Scene& scene, const tinygltf::Node& node, int material,
                std::map<int, int>& overridden) {
  if (!member(node.extras, "catoptric").IsObject()) return material;
  const auto [found, isNew] =
      overridden.try_emplace(material, static_cast<int>(scene.materials.size()));
  if (isNew) {
    Material copy = scene.materials[size(material)];
    applyReflectanceExtras(node.extras, copy);
    scene.materials.push_back(std::move(copy));
  }
  return found->second;
}

/// The objects of a node, its scene number `n`: every instance of every primitive of its mesh.
void addObjects(Reader& reader, const tinygltf::Node& source, std::size_t n,
                const std::string& place, const DrawnMeshes& drawn) {
  Scene& scene = reader.scene;
  const std::vector<Mat4> instances = readInstances(reader, source, place);
  const std::vector<int>& meshes = drawn.mesh[size(source.mesh)];
  std::map<int, int> overridden;
  for (std::size_t i = 0; i < instances.size(); ++i) {
    for (std::size_t p = 0; p < meshes.size(); ++p) {
      if (meshes[p] == kNone) continue;
      checkJoints(reader, source, p, drawn.largestJoint[size(source.mesh)][p]);
      Object object;
      object.name = scene.nodes[n].name;
      if (meshes.size() > 1) object.name += "/" + std::to_string(p);
      if (instances.size() > 1) object.name += "#" + std::to_string(i);
      object.mesh = meshes[p];
      object.node = static_cast<int>(n);
      object.material =
          ownMaterial(scene, source, drawn.material[size(source.mesh)][p], overridden);
      object.nodeFromInstance = instances[i];
      scene.objects.push_back(std::move(object));
    }
  }
  if (source.skin < 0 || scene.nodes[n].skin < 0) return;
  for (std::size_t p = 0; p < meshes.size(); ++p) {
    if (meshes[p] != kNone && scene.meshes[size(meshes[p])].joints.empty()) {
      scene.notes.push_back(place + ": has a skin, but primitive " + std::to_string(p) +
                            " of its mesh has no JOINTS_0; it follows its node");
    }
  }
}

}  // namespace

void readObjects(Reader& reader, const NodeOrder& order,
                 std::vector<std::vector<Primitive>> primitives) {
  const DrawnMeshes drawn = takeMeshes(reader, std::move(primitives));
  std::size_t hidden = 0;
  for (std::size_t n = 0; n < order.fileFromScene.size(); ++n) {
    const int file = order.fileFromScene[n];
    const tinygltf::Node& source = reader.model.nodes[size(file)];
    if (source.mesh < 0) continue;
    if (order.inScene[size(file)]) {
      addObjects(reader, source, n, elementPlace("nodes", size(file)), drawn);
    } else {
      ++hidden;
    }
  }
  if (hidden > 0) {
    reader.scene.notes.push_back(std::to_string(hidden) +
                                 " nodes with meshes are outside the scene and not drawn");
  }
}

void readLightsAndCameras(Reader& reader, const NodeOrder& order) {
  for (std::size_t n = 0; n < order.fileFromScene.size(); ++n) {
    const int file = order.fileFromScene[n];
    if (!order.inScene[size(file)]) continue;
    const tinygltf::Node& node = reader.model.nodes[size(file)];

    if (node.camera >= 0) {
      const tinygltf::Camera& source = reader.model.cameras[size(node.camera)];
      if (source.type == "perspective") {
        CameraDefinition camera;
        camera.name = !source.name.empty() ? source.name : reader.scene.nodes[n].name;
        camera.node = static_cast<int>(n);
        camera.verticalFovRad = static_cast<float>(source.perspective.yfov);
        camera.nearMetres = static_cast<float>(source.perspective.znear);
        reader.scene.cameras.push_back(std::move(camera));
      } else {
        reader.scene.notes.push_back(elementPlace("cameras", size(node.camera)) +
                                     ": orthographic cameras are ignored");
      }
    }

    const tinygltf::Value& reference = extension(node.extensions, "KHR_lights_punctual");
    if (!reference.IsObject()) continue;
    const auto index = static_cast<std::size_t>(numberOr(reference, "light", 0.0));
    const tinygltf::Light& source = reader.model.lights[index];
    const std::string place = "/extensions/KHR_lights_punctual/lights/" + std::to_string(index);
    Light light;
    light.name = !source.name.empty() ? source.name : reader.scene.nodes[n].name;
    light.node = static_cast<int>(n);
    light.type = source.type == "directional" ? LightType::Directional
                 : source.type == "spot"      ? LightType::Spot
                                              : LightType::Point;
    Vec3 color(1.0f);
    for (int c = 0; c < 3 && source.color.size() == 3; ++c) {
      color[c] = static_cast<float>(source.color[size(c)]);
    }
    light.intensity = color * static_cast<float>(source.intensity);
    light.range = static_cast<float>(source.range);
    light.position = Vec3(0.0f);
    light.direction = Vec3(0.0f, 0.0f, -1.0f);  // in the node's space
    if (light.type == LightType::Spot) {
      light.innerConeRad = static_cast<float>(source.spot.innerConeAngle);
      light.outerConeRad = static_cast<float>(source.spot.outerConeAngle);
      if (!(light.innerConeRad < light.outerConeRad)) {
        reader.fail(place + "/spot", "innerConeAngle " + std::to_string(light.innerConeRad) +
                                         " must be less than outerConeAngle " +
                                         std::to_string(light.outerConeRad));
      }
    }
    const tinygltf::Value& ours = member(source.extras, "catoptric");
    light.radius = static_cast<float>(numberOr(ours, "radius", 0.0));
    const tinygltf::Value& baked = member(ours, "baked");
    light.baked = baked.IsBool() && baked.Get<bool>();
    reader.scene.lights.push_back(std::move(light));
  }
}

}  // namespace catoptric::scene::gltf
