// Tables of the scene description.
#include <map>

#include "scene/description/description.h"
#include "scene/procedural/procedural.h"

namespace catoptric::scene {
namespace {

using config::Field;
using config::FieldType;
using config::Schema;

Field number(const char* name, const char* help, const char* defaultText = "",
             std::optional<double> minimum = {}, std::optional<double> maximum = {}) {
  return {.name = name,
          .type = FieldType::Number,
          .help = help,
          .defaultText = defaultText,
          .minimum = minimum,
          .maximum = maximum};
}
Field integer(const char* name, const char* help, const char* defaultText, double minimum,
              double maximum) {
  return {.name = name,
          .type = FieldType::Integer,
          .help = help,
          .defaultText = defaultText,
          .minimum = minimum,
          .maximum = maximum};
}
Field boolean(const char* name, const char* help, const char* defaultText) {
  return {.name = name, .type = FieldType::Bool, .help = help, .defaultText = defaultText};
}
Field choice(const char* name, const char* help, const char* defaultText,
             std::vector<std::string> allowed) {
  return {.name = name,
          .type = FieldType::String,
          .help = help,
          .defaultText = defaultText,
          .allowed = std::move(allowed)};
}
Field text(const char* name, const char* help) {
  return {.name = name, .type = FieldType::String, .help = help};
}
Field vec3(const char* name, const char* help, const char* defaultText = "") {
  return {.name = name, .type = FieldType::Vec3, .help = help, .defaultText = defaultText};
}
Field numbers(const char* name, const char* help, const char* defaultText = "",
              std::optional<double> minimum = {}, std::optional<double> maximum = {}) {
  return {.name = name,
          .type = FieldType::Numbers,
          .help = help,
          .defaultText = defaultText,
          .minimum = minimum,
          .maximum = maximum};
}
Field any(const char* name, const char* help, const char* defaultText = "") {
  return {.name = name, .type = FieldType::Any, .help = help, .defaultText = defaultText};
}
Field required(Field field) {
  field.required = true;
  return field;
}
Field arrayOf(const char* name, const char* help, FieldType items, double minimum = 0.0) {
  return {.name = name, .type = FieldType::Array, .help = help, .minimum = minimum, .items = items};
}

constexpr double kTiny = 1e-5;      // metres; nothing sensible is smaller
constexpr double kHuge = 1e6;       // metres
constexpr double kSegments = 4096;  // of one direction of one shape

const std::vector<Field>& commonFields() {
  static const std::vector<Field> fields{
      text("name", "for messages and animations"),
      any("comment", "any text"),
      text("asset", "a .gltf or .glb file"),
      boolean("lights", "assets: take their lights along", "true"),
      boolean("animated", "assets: take their animations along", "true"),
      {.name = "nodes",
       .type = FieldType::Array,
       .help = "assets: only nodes that match one of these patterns, with what is below them",
       .items = FieldType::String},
      vec3("translate", "metres, in the parent's space", "[0, 0, 0]"),
      vec3("rotate", "degrees about x, y, z; applied about z first, then x, then y", "[0, 0, 0]"),
      numbers("quaternion", "x, y, z, w instead of rotate"),
      any("scale", "a number or 3 numbers", "1"),
      any("fit", "metres per axis or null: the size that the bounding box gets"),
      choice("anchor", "the point that comes to translate", "\"origin\"",
             {"origin", "center", "bottom", "top", "back"}),
      any("material", "a material's name or a material"),
      {.name = "materials",
       .type = FieldType::Object,
       .help = "assets: material pattern to name or material"},
      any("reflective", "false, true, or {s, g} or {s, n}"),
      choice("uv", "shapes: layout of texture coordinates", "\"unit\"", {"unit", "metres"}),
      any("repeat", "{count, step, rotate_step, around}: copies"),
      {.name = "children",
       .type = FieldType::Array,
       .help = "objects in this object's space",
       .items = FieldType::Object},
      any("morph", "makes the shape deform; one or several of the table morph"),
      boolean("visible", "false: left out with its children", "true"),
  };
  return fields;
}

Field cell() {
  return number("cell", "metres, longest edge of a grid cell; instead of segments", "", 1e-3,
                kHuge);
}

Field radius(const char* standard) {
  return number("radius", "metres", standard, kTiny, kHuge);
}

Field segments(const char* help, const char* standard) {
  return numbers("segments", help, standard, 1.0, kSegments);
}

/// Parameters of the shape "implicit".
std::vector<Field> implicitFields() {
  return {
      required(choice("surface", "which", "",
                      {"plane", "sphere", "ellipsoid", "cylinder", "cone", "torus", "quadric",
                       "superquadric", "metaballs", "revolution", "vase", "gyroid", "heart",
                       "genus2", "blobby_cube", "formula"})),
      text("formula", "formula: of x, y, z in metres; the surface is where it is 0"),
      {.name = "parameters", .type = FieldType::Object, .help = "formula: names for numbers in it"},
      any("bounds",
          "where the surface ends: a half size in metres, 3 of them, or least x, y, z and "
          "largest x, y, z; formula, quadric and plane need it"),
      radius("0.5"),
      number("tube", "torus: metres", "0.2", kTiny, kHuge),
      number("height", "cylinder, cone: metres", "1", kTiny, kHuge),
      numbers("radii", "ellipsoid, superquadric: along x, y, z, metres", "", kTiny, kHuge),
      numbers("exponents", "superquadric: around y, along y", "[0.5, 0.5]", 0.1, 4.0),
      vec3("normal", "plane: points out", "[0, 1, 0]"),
      number("offset", "plane: along its normal, metres", "0", -kHuge, kHuge),
      numbers("coefficients",
              "revolution: r(y) = c0 + c1 y + ...; quadric: of xx, yy, zz, xy, xz, yz, x, y, z, "
              "1"),
      numbers("range", "revolution: y from, to, metres", "[0, 1]"),
      arrayOf("balls", "metaballs: x, y, z, radius in metres", FieldType::Numbers),
      number("sharpness", "metaballs: high ones melt together less", "2", 0.05, 100.0),
      number("period", "gyroid: metres", "1", 0.01, kHuge),
      number("thickness", "gyroid: of its wall, metres", "0.2", 1e-3, kHuge),
      numbers("segments",
              "around, along y: a regular tessellation of sphere, ellipsoid, cylinder, cone, "
              "torus, revolution, vase",
              "", 2.0, kSegments),
      integer("resolution", "cells along the longest side, without segments", "48", 4, 512)};
}

/// Own parameters of each shape.
const std::vector<std::pair<std::string, std::vector<Field>>>& shapeFields() {
  const auto size3 = numbers("size", "width, height, depth in metres", "[1, 1, 1]", kTiny, kHuge);
  static const std::vector<std::pair<std::string, std::vector<Field>>> shapes{
      {"plane",
       {numbers("size", "metres in x and z", "[1, 1]", kTiny, kHuge),
        segments("in x and z", "[1, 1]"), cell()}},
      {"box",
       {size3,
        segments("in x, y, z", "[1, 1, 1]"),
        cell(),
        boolean("inward", "faces point inwards", "false"),
        {.name = "faces",
         .type = FieldType::Array,
         .help = "which faces are made; default: all",
         .allowed = {"+x", "-x", "+y", "-y", "+z", "-z"},
         .items = FieldType::String}}},
      {"rounded_box",
       {size3, number("radius", "of the edges, metres", "0.05", kTiny, kHuge),
        integer("rounding", "segments of a quarter round", "4", 1, 64)}},
      {"panel",
       {numbers("size", "width and height in metres", "[1, 1]", kTiny, kHuge),
        number("thickness", "metres; 0: a sheet", "0", 0.0, kHuge),
        arrayOf("openings", "x, y of the lower left corner (x from the middle), width, height",
                FieldType::Numbers),
        cell()}},
      {"sphere",
       {radius("0.5"), segments("around, and from pole to pole", "[48, 24]"),
        integer("icosphere", "subdivisions of an icosahedron instead", "", 0, 8)}},
      {"torus",
       {radius("0.5"), number("tube", "radius of the tube, metres", "0.2", kTiny, kHuge),
        segments("around, and around the tube", "[64, 32]")}},
      {"disk",
       {radius("0.5"), number("inner", "radius of a hole, metres", "0", 0.0, kHuge),
        segments("around, rings", "[48, 1]"), cell()}},
      {"cylinder",
       {radius("0.5"),
        number("top", "radius at the top; default: radius; 0: a cone", "", 0.0, kHuge),
        number("height", "metres", "1", kTiny, kHuge), segments("around, upwards", "[48, 1]"),
        boolean("caps", "closed below and above", "true")}},
      {"teapot",
       {number("height", "metres", "0.5", kTiny, kHuge),
        integer("segments", "per edge of a patch", "10", 1, 256),
        boolean("lid", "with the lid", "true")}},
      {"revolution",
       {{.name = "profile",
         .type = FieldType::Array,
         .help = "[r, y] in metres from bottom to top",
         .items = FieldType::Numbers},
        choice("curve", "through the profile", "\"catmull_rom\"",
               {"polyline", "catmull_rom", "bezier", "polynomial"}),
        numbers("coefficients", "polynomial: r(y) = c0 + c1 y + ..."),
        numbers("range", "polynomial: y from, to, metres", "[0, 1]"),
        number("thickness", "metres; > 0: a vessel with an inner wall and a rim", "0", 0.0, kHuge),
        segments("around, along", "[64, 48]"),
        number("smooth_angle", "degrees; sharper bends keep an edge", "40", 0.0, 180.0),
        boolean("caps", "closes ends that are off the axis", "true")}},
      {"tube",
       {required(arrayOf("points", "metres", FieldType::Vec3, 2.0)),
        any("radius", "metres; one, or one per point", "0.02"),
        choice("curve", "through the points", "\"catmull_rom\"", {"catmull_rom", "polyline"}),
        segments("around, along each span", "[16, 8]"), boolean("closed", "a ring", "false"),
        boolean("caps", "rounded ends", "true")}},
      {"prism",
       {required(arrayOf("outline", "[x, z] in metres; a simple polygon", FieldType::Numbers, 3.0)),
        number("height", "metres", "1", kTiny, kHuge), number("bevel", "metres", "0", 0.0, kHuge)}},
      {"polygons",
       {required(arrayOf("vertices", "metres", FieldType::Vec3, 3.0)),
        required(arrayOf("faces", "vertex numbers, counter-clockwise from outside",
                         FieldType::Numbers, 1.0)),
        boolean("smooth", "normals are shared at vertices", "false")}},
      {"implicit", implicitFields()},
  };
  return shapes;
}

Schema withCommon(const std::string& name, const std::vector<Field>& own) {
  Schema schema{name, "an object of a scene", {}};
  schema.fields = commonFields();
  if (!own.empty() || name != "object") schema.fields.push_back(text("shape", "a built-in shape"));
  schema.fields.insert(schema.fields.end(), own.begin(), own.end());
  return schema;
}

}  // namespace

const std::vector<std::string>& shapeNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& [name, fields] : shapeFields()) all.push_back(name);
    return all;
  }();
  return names;
}

const Schema& objectSchema(const std::string& shape) {
  static const std::map<std::string, Schema> schemas = [] {
    std::map<std::string, Schema> all;
    all.emplace("", withCommon("object", {}));
    for (const auto& [name, fields] : shapeFields()) {
      all.emplace(name, withCommon("object (" + name + ")", fields));
    }
    return all;
  }();
  return schemas.at(shape);
}

const Schema& materialSchema() {
  static const Schema schema{
      "material",
      "s and g (or n), or glTF's metallic and roughness",
      {
          any("comment", "any text"),
          any("base_color", "albedo; [r, g, b] linear or \"#rrggbb\"", "[1, 1, 1]"),
          any("texture", "a file or {\"procedural\": ...}"),
          any("normal_map", "a file, {\"procedural\": ..., \"strength\"}, or \"match\""),
          number("normal_scale", "multiplies the slopes", "1", -100.0, 100.0),
          text("metallic_roughness_map", "a file; roughness in green, metallic in blue"),
          any("uv_scale", "a number or 2 numbers", "1"),
          numbers("uv_offset", "2 numbers", "[0, 0]"),
          number("uv_rotate", "degrees", "0"),
          choice("filter", "of textures", "\"linear\"", {"linear", "nearest"}),
          choice("wrap", "of textures", "\"repeat\"", {"repeat", "mirror", "clamp"}),
          number("s", "specular level, 0 diffuse to 1 mirror", "", 0.0, 1.0),
          number("g", "glossiness, 0 mirror to 1", "", 0.0, 1.0),
          number("n", "Phong exponent instead of g", "", 0.0, 1e9),
          any("tint", "colour of the reflection", "[1, 1, 1]"),
          number("refraction", "index of the body: s refracts instead of mirroring", "", 1.0, 10.0),
          number("metallic", "0 to 1", "0", 0.0, 1.0),
          number("roughness", "0 to 1", "1", 0.0, 1.0),
          number("ior", "index of refraction", "1.5", 1.0, 10.0),
          number("specular", "multiplies the dielectric reflection", "1", 0.0, 1.0),
          any("emissive", "radiance", "[0, 0, 0]"),
          number("emissive_strength", "multiplies emissive", "1", 0.0, 1e30),
          any("emissive_texture", "a file or {\"procedural\": ...}"),
          number("alpha_cutoff", "texels with less alpha are cut out", "", 0.0, 1.0),
          boolean("unlit", "radiance = albedo", "false"),
          boolean("keep", "overrides: change only what is named", "false"),
      }};
  return schema;
}

const Schema& lightSchema() {
  static const Schema schema{
      "light",
      "a light",
      {
          text("name", "for messages"),
          any("comment", "any text"),
          required(choice("type", "kind", "", {"point", "spot", "directional", "sphere"})),
          vec3("position", "metres", "[0, 0, 0]"),
          vec3("direction", "where it shines to", "[0, -1, 0]"),
          vec3("target", "metres; instead of direction"),
          any("color", "[r, g, b] linear or \"#rrggbb\"", "[1, 1, 1]"),
          number("intensity", "W/sr; directional: W/m^2", "1", 0.0, 1e30),
          number("range", "metres; 0: unlimited", "0", 0.0, kHuge),
          number("inner_cone", "half angle, degrees", "0", 0.0, 90.0),
          number("outer_cone", "half angle, degrees", "45", 0.0, 90.0),
          number("radius", "metres; soft baked shadows", "0", 0.0, kHuge),
          boolean("baked", "acts through the bake, with shadows", "false"),
          text("object", "position and direction are in this object's space"),
      }};
  return schema;
}

const Schema& morphSchema() {
  static const Schema schema{
      "morph",
      "a deformation of a shape",
      {
          required(choice("type", "kind", "", {"wave", "flag", "bulge", "twist", "stretch"})),
          number("amplitude", "metres; twist: turns; stretch: share of the length", "0.1", -kHuge,
                 kHuge),
          number("waves", "along the shape", "2", 0.0, 1000.0),
          vec3("axis", "of the displacement", "[0, 1, 0]"),
          number("cycle", "seconds of an endless loop; none: animate the channel morph", "", 0.01,
                 1e6),
          number("duration", "seconds that the loop goes on", "10", 0.01, 1e6),
      }};
  return schema;
}

namespace {

const Schema& environmentSchema() {
  static const Schema schema{
      "environment",
      "radiance from infinitely far away",
      {
          required(choice("type", "kind", "", {"constant", "gradient", "file"})),
          any("color", "constant: radiance"),
          any("zenith", "gradient: radiance above"),
          any("horizon", "gradient"),
          any("ground", "gradient: radiance below"),
          text("file", "latitude-longitude image, EXR or HDR"),
          number("scale", "multiplies all", "1", 0.0, 1e30),
          number("rotate", "degrees about +y; files", "0"),
      }};
  return schema;
}

const Schema& bakeSchema() {
  static const Schema schema{
      "bake",
      "what is baked per vertex at load",
      {
          choice("mode", "what", "\"none\"", {"none", "ambient_occlusion", "full"}),
          integer("rays", "hemisphere rays per vertex", "256", 1, 65536),
          integer("bounces", "gathers of interreflection (full)", "2", 0, 16),
          number("distance", "of occluders, metres; 0: a tenth of the scene's diameter", "0", 0.0,
                 kHuge),
      }};
  return schema;
}

const Schema& animationSchema() {
  static const Schema schema{
      "animation",
      "keys of one channel of one object",
      {
          any("comment", "any text"),
          required(text("object", "its name")),
          required(choice("channel", "what is animated", "",
                          {"translate", "rotate", "scale", "quaternion", "morph"})),
          choice("interpolation", "between keys", "\"linear\"", {"linear", "step", "smooth"}),
          required(arrayOf("keys", "[seconds, values...]", FieldType::Numbers, 1.0)),
      }};
  return schema;
}

const Schema& cameraSchema() {
  static const Schema schema{
      "camera",
      "a fixed camera",
      {
          text("name", "for paths"),
          required(vec3("position", "metres")),
          required(vec3("target", "metres")),
          number("fov", "vertical field of view, degrees", "60", 0.001, 179.9),
      }};
  return schema;
}

}  // namespace

const Schema& sceneSchema() {
  // Objects are checked one by one with their shape's own table.
  static const Schema anyObject = [] {
    Schema schema = withCommon("object", {});
    schema.fields.push_back(text("shape", "a built-in shape"));
    schema.open = true;
    return schema;
  }();
  static const Schema schema{
      "scene",
      "A scene description.",
      {
          text("$schema", "For editors; not read."),
          text("name", "for reports"),
          any("comment", "any text"),
          {.name = "objects",
           .type = FieldType::Array,
           .help = "what is in the scene",
           .required = true,
           .object = &anyObject},
          {.name = "materials", .type = FieldType::Object, .help = "name to material"},
          {.name = "lights", .type = FieldType::Array, .help = "lights", .object = &lightSchema()},
          {.name = "environment",
           .type = FieldType::Object,
           .help = "default: black",
           .object = &environmentSchema()},
          any("ambient", "radiance from everywhere, [r, g, b] or \"#rrggbb\"", "[0, 0, 0]"),
          {.name = "bake", .type = FieldType::Object, .help = "baking", .object = &bakeSchema()},
          {.name = "animation",
           .type = FieldType::Array,
           .help = "moving objects",
           .object = &animationSchema()},
          {.name = "cameras",
           .type = FieldType::Array,
           .help = "fixed cameras",
           .object = &cameraSchema()},
      }};
  return schema;
}

}  // namespace catoptric::scene
