// Where described objects stand: copies, fitting, scales and rotations.
#include <cmath>

#include "scene/description/composer.h"

namespace catoptric::scene {
namespace {

using config::Value;

Quat quaternionOf(const Value& value) {
  const std::vector<float> q = value.asFloats(4);
  const Quat rotation(q[3], q[0], q[1], q[2]);
  if (!(glm::length(rotation) > 1e-6f)) value.fail("the quaternion is zero");
  return glm::normalize(rotation);
}

Vec3 scaleOf(const Value& value) {
  return value.kind() == Value::Kind::Array ? value.asVec3()
                                            : Vec3(static_cast<float>(value.asNumber()));
}

}  // namespace

void Composer::add(const Value& object, int parent, config::Errors& errors) {
  if (!object.has("repeat")) {
    addOne(object, parent, "", errors);
    return;
  }
  const Value repeat = object.get("repeat");
  for (const std::string& key : repeat.keys()) {
    if (key != "count" && key != "step" && key != "rotate_step" && key != "around") {
      repeat.get(key).fail("unknown name \"" + key +
                           "\"; allowed: count, step, rotate_step, around");
    }
  }
  const Vec3 at = object.has("translate") ? object.get("translate").asVec3() : Vec3(0.0f);
  const auto place = [&](const Vec3& offset, const Quat& rotation, std::size_t index) {
    // Turned about the object's own position, then moved.
    Node node;
    node.name = nameOf(object) + " copy";
    node.parent = parent;
    node.rotation = rotation;
    node.translation = at + offset - rotation * at;
    addOne(object, addNode(std::move(node), repeat), " " + std::to_string(index + 1), errors);
  };
  if (repeat.has("around")) {
    const Value around = repeat.get("around");
    const int count = countOf(around.get("count"));
    const auto radius = static_cast<float>(around.get("radius").asNumber());
    for (int i = 0; i < count; ++i) {
      const Quat turn = glm::angleAxis(
          2.0f * kPi * static_cast<float>(i) / static_cast<float>(count), Vec3(0.0f, 1.0f, 0.0f));
      place(turn * Vec3(0.0f, 0.0f, radius), turn, static_cast<std::size_t>(i));
    }
    return;
  }
  const Value count = repeat.get("count");
  const Vec3 step = repeat.has("step") ? repeat.get("step").asVec3() : Vec3(0.0f);
  const Vec3 turn = repeat.has("rotate_step") ? repeat.get("rotate_step").asVec3() : Vec3(0.0f);
  std::size_t index = 0;
  if (count.kind() != Value::Kind::Array) {
    const int n = countOf(count);
    for (int i = 0; i < n; ++i) {
      place(static_cast<float>(i) * step, rotationOf(static_cast<float>(i) * turn), index++);
    }
    return;
  }
  if (count.asArray().size() != 3) count.fail(count.dump() + " is not a number or 3 numbers");
  const glm::ivec3 n(countOf(count.asArray()[0]), countOf(count.asArray()[1]),
                     countOf(count.asArray()[2]));
  if (std::int64_t{n.x} * n.y > static_cast<std::int64_t>(limits_.maxNodes) / n.z) {
    count.fail(count.dump() + " asks for more than the " + std::to_string(limits_.maxNodes) +
               " nodes allowed");
  }
  for (int z = 0; z < n.z; ++z) {
    for (int y = 0; y < n.y; ++y) {
      for (int x = 0; x < n.x; ++x) {
        const Vec3 i(x, y, z);
        place(i * step, rotationOf((i.x + i.y + i.z) * turn), index++);
      }
    }
  }
}

void Composer::addOne(const Value& object, int parent, const std::string& suffix,
                      config::Errors& errors) {
  Node node;
  node.name = nameOf(object) + suffix;
  node.parent = parent;
  if (object.has("translate")) node.translation = object.get("translate").asVec3();
  if (object.has("rotate") && object.has("quaternion")) {
    object.fail("has both \"rotate\" and \"quaternion\"; remove one");
  }
  if (object.has("rotate")) node.rotation = rotationOf(object.get("rotate").asVec3());
  if (object.has("quaternion")) node.rotation = quaternionOf(object.get("quaternion"));
  if (object.has("scale")) node.scale = scaleOf(object.get("scale"));
  const std::string name = node.name;
  const int self = addNode(std::move(node), object);
  Handle handle{self, kNone};
  if (object.has("shape")) {
    handle.meshNode = addShape(object, self, name);
  } else if (object.has("asset")) {
    addAsset(object, self, name);
  } else {
    for (const char* key :
         {"fit", "anchor", "material", "materials", "reflective", "morph", "nodes"}) {
      if (object.has(key)) {
        object.get(key).fail(std::string("\"") + key + "\" needs a \"shape\" or an \"asset\"");
      }
    }
  }
  handles_[nameOf(object)].push_back(handle);
  if (object.has("children")) addAll(object.get("children").asArray(), self, errors);
}

int Composer::countOf(const Value& value) const {
  const std::int64_t n = value.asInteger();
  if (n < 1 || n > static_cast<std::int64_t>(limits_.maxNodes)) {
    value.fail(std::to_string(n) + " is out of range; allowed: 1 to " +
               std::to_string(limits_.maxNodes));
  }
  return static_cast<int>(n);
}

int Composer::fitted(const Value& object, int self, const Box3& bounds) {
  if (!object.has("fit") && !object.has("anchor")) return self;
  const Vec3 size = bounds.max - bounds.min;
  Vec3 scale(1.0f);
  if (object.has("fit")) {
    const Value fit = object.get("fit");
    if (fit.asArray().size() != 3) fit.fail(fit.dump() + " is not an array of 3 numbers or nulls");
    double logSum = 0.0;
    int given = 0;
    for (int a = 0; a < 3; ++a) {
      const Value wanted = fit.asArray()[static_cast<std::size_t>(a)];
      if (wanted.isNull()) continue;
      const double metres = wanted.asNumber();
      if (!(metres > 0.0)) wanted.fail("a size must be above 0");
      if (!(size[a] > 0.0f)) {
        wanted.fail(std::string("the object is flat along ") + "xyz"[a] + "; write null here");
      }
      scale[a] = static_cast<float>(metres / static_cast<double>(size[a]));
      logSum += std::log(static_cast<double>(scale[a]));
      ++given;
    }
    if (given == 0) fit.fail("\"fit\" needs at least one number");
    for (int a = 0; a < 3; ++a) {
      if (fit.asArray()[static_cast<std::size_t>(a)].isNull()) {
        scale[a] = static_cast<float>(std::exp(logSum / given));
      }
    }
  }
  Vec3 pivot(0.0f);
  const std::string anchor =
      object.has("anchor") ? object.get("anchor").asString() : std::string("origin");
  if (anchor != "origin") {
    pivot = bounds.centre();
    if (anchor == "bottom") pivot.y = bounds.min.y;
    if (anchor == "top") pivot.y = bounds.max.y;
    if (anchor == "back") pivot.z = bounds.min.z;
  }
  Node node;
  node.name = scene_.nodes[static_cast<std::size_t>(self)].name + " fit";
  node.parent = self;
  node.scale = scale;
  node.translation = -scale * pivot;
  return addNode(std::move(node), object);
}

Quat rotationOf(const Vec3& d) {
  const Quat x = glm::angleAxis(radians(d.x), Vec3(1.0f, 0.0f, 0.0f));
  const Quat y = glm::angleAxis(radians(d.y), Vec3(0.0f, 1.0f, 0.0f));
  const Quat z = glm::angleAxis(radians(d.z), Vec3(0.0f, 0.0f, 1.0f));
  return glm::normalize(y * x * z);
}

}  // namespace catoptric::scene
