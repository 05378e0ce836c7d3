// Which method a suite takes, of times and errors that are made up.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/error.h"
#include "study/suite.h"

namespace catoptric::study {
namespace {

using config::parseText;
using testing::HasSubstr;

struct Made {
  std::string method;
  double seconds;  ///< of a frame, of which 0.06 are its G-buffer
  double error;
  double flicker = 0.0;
};

/// A run "room", of frames 1 and 2 in ten rounds; `traced` is the reference.
class Room {
 public:
  explicit Room(const std::vector<Made>& all) {
    samples_.frames = {1, 2};
    samples_.repeats = 10;
    samples_.measurement.settings.resize(all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      samples_.keys.push_back(all[i].method);
      for (int round = 1; round <= 10; ++round)
        for (const int frame : samples_.frames) {
          Turn turn{round, round, i, frame, {}};
          turn.report.seconds = all[i].seconds * (1.0 + 0.001 * round);
          turn.report.steps["gbuffer"] = 0.06 * (1.0 + 0.001 * round);
          turn.report.memoryBytes = 1'000'000 * (100 * i + static_cast<std::size_t>(round));
          samples_.measurement.turns.push_back(turn);
        }
    }
    for (std::size_t i = 0; i < all.size(); ++i) {
      SuiteData::Entry& entry = data.runs["room"][all[i].method];
      entry.setting.point.method = entry.setting.key = all[i].method;
      entry.samples = &samples_;
      entry.index = i;
      entry.base = "traced";
      entry.frames = samples_.frames;
      for (const int frame : samples_.frames) {
        FrameErrors& errors = entry.errors.frames[frame];
        errors.metrics = {{"L1_8bit", all[i].error}, {"flicker", all[i].flicker}};
        errors.flickerPixels = 1;
      }
    }
  }

  std::string cell(const std::string& call) const {
    return data.cell(parseText("\"" + call + "\"", "suite"));
  }

  SuiteData data;

 private:
  Samples samples_;
};

TEST(SuiteChoice, TakesTheFastestWithinErrorAndFlicker) {
  const Room room({{"traced", 0.1, 0.0},
                   {"exact", 0.09, 0.1},
                   {"fast", 0.07, 0.9},
                   {"flickers", 0.064, 0.9, 6.0},
                   {"same", 0.0999, 0.0},
                   {"slow", 0.2, 0.01}});
  EXPECT_EQ(room.cell("take(room.*, 0.05)"), "traced");  // "same" is not faster with confidence
  EXPECT_EQ(room.cell("take(room.*, 0.5)"), "exact 0.90 / 0.75");
  EXPECT_EQ(room.cell("take(room.*, 1)"), "fast 0.70 / 0.25");
  EXPECT_EQ(room.cell("take(room.*, 2)"), "flickers 0.64 / 0.10");
}

TEST(SuiteChoice, MarksTheFrontOfBothTimes) {
  const Room room({{"traced", 0.1, 0.0}, {"exact", 0.09, 0.1}, {"poor", 0.095, 3.0}});
  for (const char* time : {"frame", "reflection"}) {
    const auto mark = [&](const std::string& method) {
      return room.cell("front(room." + method + ", " + time + ")");
    };
    EXPECT_EQ(mark("traced"), "front");
    EXPECT_EQ(mark("exact"), "front");
    EXPECT_EQ(mark("poor"), "dominated");
  }
}

TEST(SuiteChoice, TheChartsOfATableShowItsFront) {
  const Room room({{"traced", 0.1, 0.0}, {"exact", 0.09, 0.1}, {"poor", 0.095, 3.0}});
  SuiteRun run;
  run.name = "room";
  run.methods = {"traced", "exact", "poor", "refuses"};
  Room all = room;
  all.data.runs["room"]["refuses"].refused = "refuses 1";
  Suite suite;
  suite.tables = expandedTables(parseText(R"json([{"title": "TITLE", "each": {"room": "a room"},
          "columns": ["method", "L1", "time", "front"],
          "row": ["METHOD", "error(RUN.METHOD, L1_8bit)", "ratio(RUN.METHOD, RUN.traced)",
                  "front(RUN.METHOD, frame)"]}])json",
                                          "suite")
                                    .asArray(),
                                {run});
  const auto draw = [&](const std::string& y) {
    suite.figures = parseText(R"json([{"of_table": 1, "y": ")json" + y + R"json(", "panels": [
        {"x": "time", "mark": "front", "title": "frame"},
        {"x": "time", "mark": "front", "title": "again"}]}])json",
                              "suite")
                        .asArray();
    return suiteFigures(suite, all.data).at(0);
  };
  const SuiteFigure figure = draw("L1");
  ASSERT_EQ(figure.charts.size(), 2u);
  EXPECT_EQ(figure.columns, 2);
  const Chart& chart = figure.charts[0];
  EXPECT_EQ(chart.title + ", " + chart.xTitle + ", " + chart.yTitle, "a room, frame, L1");
  EXPECT_EQ(figure.charts[1].xTitle, "again");
  ASSERT_EQ(chart.series.size(), 2u);
  ASSERT_EQ(chart.series[0].points.size(), 2u);  // the front
  EXPECT_EQ(chart.series[0].points[1].label, "exact");
  EXPECT_NEAR(chart.series[0].points[1].x, 0.9, 1e-6);
  EXPECT_NEAR(chart.series[0].points[1].y, 0.1, 1e-6);
  ASSERT_EQ(chart.series[1].points.size(), 1u);
  EXPECT_EQ(chart.series[1].points[0].label, "poor");
  EXPECT_EQ(chart.series[1].points[0].mark, Mark::Dominated);
  EXPECT_THAT([&] { draw("L2"); },
              testing::ThrowsMessage<UsageError>(HasSubstr("no column \"L2\"")));
}

TEST(SuiteChoice, TheMemoryIsTheMostOfItsProcess) {
  const Room room({{"traced", 0.1, 0.0}, {"exact", 0.09, 0.1}});
  EXPECT_EQ(room.cell("memory_mb(room.traced)"), "10.0");
  EXPECT_EQ(room.cell("memory_mb(room.exact)"), "110");
}

TEST(SuiteChoice, AMethodThatRefusesHasItsReasonAndNoFigures) {
  Room room({{"traced", 0.1, 0.0}});
  room.data.runs["room"]["planar"].refused = "refuses 3: is no flat mirror";
  EXPECT_EQ(room.cell("refused(room.planar)"), "refuses 3: is no flat mirror");
  EXPECT_EQ(room.cell("refused(room.traced)"), "");
  for (const char* call :
       {"error(room.planar, L1_8bit)", "ratio(room.planar, room.traced)", "most(room.planar, rays)",
        "memory_mb(room.planar)", "front(room.planar, frame)"})
    EXPECT_EQ(room.cell(call), "") << call;
  EXPECT_EQ(room.cell("take(room.*, 1)"), "traced");
}

TEST(SuiteChoice, TablesOfEachRunHaveARowForEachMethod) {
  SuiteRun room;
  room.name = "room";
  room.methods = {"a", "b"};
  SuiteRun hall = room;
  hall.name = "hall";
  hall.methods = {"a"};
  const config::Value stated = parseText(
      R"json([{"title": "TITLE", "each": {"room": "a room", "hall": "a hall"}, "columns": ["m", "ms"],
           "row": ["METHOD", "ms(RUN.METHOD)"]},
          {"title": "all", "each": {"room": "a room", "hall": "a hall"}, "columns": ["r", "take"],
           "row": ["TITLE", "take(RUN.*, 1)"]}])json",
      "suite");
  const std::vector<config::Value> tables = expandedTables(stated.asArray(), {room, hall});
  ASSERT_EQ(tables.size(), 3u);
  EXPECT_EQ(tables[0].get("title").asString(), "a room");
  EXPECT_EQ(tables[0].get("rows").dump(), R"json([["a","ms(room.a)"],["b","ms(room.b)"]])json");
  EXPECT_EQ(tables[1].get("rows").dump(), R"json([["a","ms(hall.a)"]])json");
  EXPECT_EQ(tables[2].get("rows").dump(),
            R"json([["a room","take(room.*, 1)"],["a hall","take(hall.*, 1)"]])json");
  EXPECT_THAT([&] { expandedTables(stated.asArray(), {room}); },
              testing::ThrowsMessage<UsageError>(HasSubstr("\"hall\" is not a run")));
}

}  // namespace
}  // namespace catoptric::study
