#include "report/motion_tables.h"

#include "config/json_text.h"
#include "core/text.h"

namespace catoptric::report {
namespace {

using measure::Flicker;
using measure::MotionError;

bool hasWindows(const MotionError& motion) {
  return motion.windowPixels > 0;
}

std::string worstText(const MotionError& motion) {
  return "Most flicker: frame " + std::to_string(motion.worstFrame) + " (" +
         fixedText(motion.frames.at(motion.worstFrame).mean(), 3) + "); there most around pixel " +
         std::to_string(motion.worstX) + "," + std::to_string(motion.worstY) + " (" +
         fixedText(motion.worstTile, 3) + " over " + std::to_string(MotionError::kTile) + " x " +
         std::to_string(MotionError::kTile) + " pixels).";
}

}  // namespace

Table motionView(const RunComparison& comparison) {
  const MotionError& motion = comparison.motion;
  Table table;
  table.title = "Stability over time, " + std::to_string(motion.pairs) + " pairs of frames";
  if (motion.pairs == 0) {
    table.notes.emplace_back(
        "Flicker is measured between consecutive frames, and no two frames are consecutive.");
    return table;
  }
  table.columns = {{"pixels", false},    {"flicker", true},     {"floor", true},
                   {"flicker_mc", true}, {"unmatched %", true}, {"steady", true},
                   {"unsteady", true}};
  const auto floorText = [&](const Flicker& flicker) {
    return motion.hasFloor ? fixedText(flicker.floor(), 3) : "";
  };
  table.rows.push_back({motion.hasReflective ? "reflective" : "all",
                        fixedText(motion.all.mean(), 3), floorText(motion.all),
                        motion.hasMotion ? fixedText(motion.alongMotion.mean(), 3) : "",
                        motion.hasMotion ? fixedText(motion.unmatchedPercent(), 1) : "",
                        hasWindows(motion) ? fixedText(motion.steady(), 3) : "",
                        hasWindows(motion) ? fixedText(motion.unsteady(), 3) : ""});
  for (const auto& [id, flicker] : motion.objects) {
    const auto name = comparison.objectNames.find(id);
    table.rows.push_back(
        {name == comparison.objectNames.end() ? "object " + std::to_string(id) : name->second,
         fixedText(flicker.mean(), 3), floorText(flicker)});
  }
  table.notes.push_back(worstText(motion));
  if (motion.hasFloor && motion.all.mean() <= motion.all.floor())
    table.notes.push_back("The flicker is not above its floor: it may be that of " +
                          comparison.reference + " alone.");
  if (!motion.gaps.empty())
    table.notes.push_back(
        "Left out, because the frame before is missing: " + std::to_string(motion.gaps.size()) +
        " frames, first frame " + std::to_string(motion.gaps.front()) + ".");
  if (!motion.hasMotion)
    table.notes.emplace_back(
        "flicker_mc needs frames with image.layers=[\"motion\",\"Z\",\"id\"].");
  table.notes.push_back(
      "In display steps. flicker: mean change of a pixel's error from frame to frame; floor: the "
      "flicker of the reference's own error, from its standard_error; flicker_mc: "
      "the same along the motion of surfaces, without unmatched pixels; steady, unsteady: root "
      "mean square of the constant and the changing part of the error over " +
      std::to_string(MotionError::kWindow) + " frames.");
  return table;
}

std::string motionCsv(std::span<const RunComparison> comparisons) {
  std::string text =
      "method,against,frame,region,pixels,flicker,floor,flicker_mc,unmatched_percent,steady,"
      "unsteady\n";
  for (const RunComparison& c : comparisons) {
    const auto row = [&](const std::string& frame, const std::string& region,
                         const Flicker& flicker, const std::string& rest) {
      const std::string floor = c.motion.hasFloor ? exactText(flicker.floor()) : "";
      text += csvCell(c.name) + "," + csvCell(c.reference) + "," + frame + "," + region + "," +
              std::to_string(flicker.pixels) + "," + exactText(flicker.mean()) + "," + floor + "," +
              rest + "\n";
    };
    const MotionError& motion = c.motion;
    const std::string region = motion.hasReflective ? "reflective" : "frame";
    for (const auto& [number, flicker] : motion.frames)
      row(std::to_string(number), region, flicker, ",,,");
    for (const auto& [id, flicker] : motion.objects)
      row("all", "object:" + std::to_string(id), flicker, ",,,");
    if (motion.pairs > 0)
      row("all", region, motion.all,
          (motion.hasMotion
               ? exactText(motion.alongMotion.mean()) + "," + exactText(motion.unmatchedPercent())
               : ",") +
              "," +
              (hasWindows(motion) ? exactText(motion.steady()) + "," + exactText(motion.unsteady())
                                  : ","));
  }
  return text;
}

std::string motionJson(const MotionError& motion) {
  if (motion.pairs == 0) return "null";
  config::JsonText text;
  text.add("pairs", motion.pairs)
      .add("region", std::string(motion.hasReflective ? "reflective" : "frame"))
      .add("flicker", motion.all.mean());
  if (motion.hasFloor) text.add("flicker_floor", motion.all.floor());
  if (motion.hasMotion)
    text.add("flicker_mc", motion.alongMotion.mean())
        .add("unmatched_percent", motion.unmatchedPercent());
  if (hasWindows(motion)) text.add("steady", motion.steady()).add("unsteady", motion.unsteady());
  text.add("worst_frame", motion.worstFrame)
      .add("worst_pixel", std::vector<int>{motion.worstX, motion.worstY})
      .add("worst_tile", motion.worstTile)
      .add("gaps", motion.gaps);
  config::JsonText frames;
  for (const auto& [number, flicker] : motion.frames)
    frames.add(std::to_string(number), flicker.mean());
  config::JsonText objects;
  for (const auto& [id, flicker] : motion.objects) objects.add(std::to_string(id), flicker.mean());
  return text.raw("frames", frames.object()).raw("objects", objects.object()).object();
}

}  // namespace catoptric::report
