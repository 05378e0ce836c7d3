#include "methods/depth_impostors/srdm.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/lanes.h"
#include "core/parallel.h"
#include "methods/depth_impostors/columns.h"

// Loops over samples are plain ones that the compiler turns into vector code, once for each level
// of the machine; all give the same bits.
namespace catoptric::methods::depth_impostors {
namespace {

constexpr int kLanes = 16;  ///< the most values of a vector
constexpr int kLines = 32;  ///< that are sampled at once; ours
CATOPTRIC_INLINE int wholeLanes(int count) {
  return (count + kLanes - 1) & ~(kLanes - 1);
}

/// A segment of a line's polyline, between two samples.
struct Segment {
  int from = 0;
  int to = 0;
  float error = 0.0f;
  int worst = 0;       ///< sample
  int next = -1;       ///< the segment behind it on the line
  bool first = false;  ///< of its span
};

/// The largest distance of samples between two of them from the line through these, and where it
/// is first. `g`: with kLanes more behind the last sample. `errors`: room for as many.
CATOPTRIC_INLINE void measure(const float* g, Segment& segment, float* errors) {
  segment.error = 0.0f;
  segment.worst = segment.from;
  const int length = segment.to - segment.from;
  if (length < 2) return;
  const float* const at = g + segment.from;
  const float start = at[0];
  const float step = (at[length] - start) / static_cast<float>(length);
  // Whole vectors, of which what lies behind the segment counts nothing
  const int rounded = wholeLanes(length);
  float most = 0.0f;
  CATOPTRIC_INDEPENDENT
  for (int k = 0; k < rounded; ++k) {
    const float off = std::abs(at[k] - (start + step * static_cast<float>(k)));
    const float error = k < length ? off : 0.0f;
    errors[k] = error;
    most = error > most ? error : most;
  }
  if (!(most > 0.0f)) return;
  int worst = length;
  CATOPTRIC_INDEPENDENT
  for (int k = 0; k < rounded; ++k) {
    const int place = errors[k] == most ? k : length;
    worst = place < worst ? place : worst;
  }
  segment.error = most;
  segment.worst = segment.from + worst;
}

struct Span {
  int from = 0;
  int to = 0;  ///< last sample
};

/// What simplify() works with, kept from line to line.
struct Work {
  std::vector<Span> spans;
  std::vector<Segment> segments;
  std::vector<std::uint8_t> covered;  ///< by sample
  std::vector<float> errors;          ///< measure()'s
  std::vector<float> across;          ///< samples of kLines lines, one column after another
  std::vector<float> lines;           ///< the same, one line after another
};

/// Runs of samples; of more than `most` the longest.
CATOPTRIC_INLINE void findSpans(const float* g, std::size_t count, std::size_t most, Work& work,
                                Simplification& done) {
  std::vector<Span>& spans = work.spans;
  spans.clear();
  work.covered.resize(count + 1);
  std::uint8_t* const covered = work.covered.data();
  CATOPTRIC_INDEPENDENT
  for (std::size_t k = 0; k < count; ++k) covered[k] = g[k] > 0.0f ? 1 : 0;
  covered[count] = 0;
  const auto find = [&](std::size_t k, int what) {
    const void* const found = std::memchr(covered + k, what, count + 1 - k);
    return found == nullptr
               ? count
               : static_cast<std::size_t>(static_cast<const std::uint8_t*>(found) - covered);
  };
  for (std::size_t k = find(0, 1); k < count;) {
    const std::size_t end = find(k, 0);
    done.samples += end - k;
    spans.push_back({static_cast<int>(k), static_cast<int>(end) - 1});
    k = find(end, 1);
  }
  done.spans += spans.size();
  while (spans.size() > most) {
    const auto shortest = std::min_element(
        spans.begin(), spans.end(),
        [](const Span& a, const Span& b) { return a.to - a.from < b.to - b.from; });
    ++done.lostSpans;
    done.lostSamples += static_cast<std::uint64_t>(shortest->to - shortest->from + 1);
    spans.erase(shortest);
  }
}

/// The segment of the largest error; of several the first on the line.
CATOPTRIC_INLINE std::size_t worstOf(const std::vector<Segment>& segments) {
  std::size_t worst = 0;
  for (std::size_t i = 1; i < segments.size(); ++i) {
    const Segment& a = segments[worst];
    const Segment& b = segments[i];
    if (b.error > a.error || (b.error == a.error && b.from < a.from)) worst = i;
  }
  return worst;
}

/// A line's samples (0: background) to `points`, which it fills. Each run of samples begins with
/// two points; the segment of the largest error is split where that is, until the points are used
/// up or no error is left. `g`: `count` samples and kLanes more.
CATOPTRIC_INLINE void simplify(const float* g, std::size_t count, std::span<Point> points,
                               Work& work, Simplification& done) {
  std::fill(points.begin(), points.end(), kUnused);
  work.errors.resize(count + kLanes);
  findSpans(g, count, points.size() / 2, work, done);
  if (work.spans.empty()) return;
  std::vector<Segment>& segments = work.segments;
  segments.clear();
  for (const Span& span : work.spans) {
    Segment segment{span.from, span.to, 0.0f, 0, -1, true};
    measure(g, segment, work.errors.data());
    if (!segments.empty()) segments.back().next = static_cast<int>(segments.size());
    segments.push_back(segment);
  }
  // A split adds one point. Of a few segments the worst is found faster than a heap is kept
  for (std::size_t used = 2 * work.spans.size(); used < points.size(); ++used) {
    const std::size_t worst = worstOf(segments);
    const Segment whole = segments[worst];
    if (!(whole.error > 0.0f)) break;
    Segment left{whole.from, whole.worst, 0.0f, 0, static_cast<int>(segments.size()), whole.first};
    Segment right{whole.worst, whole.to, 0.0f, 0, whole.next, false};
    measure(g, left, work.errors.data());
    measure(g, right, work.errors.data());
    segments[worst] = left;
    segments.push_back(right);
  }
  std::size_t at = 0;
  const auto place = [](int sample) { return static_cast<float>(sample) + 0.5f; };
  for (int i = 0; i >= 0; i = segments[static_cast<std::size_t>(i)].next) {
    const Segment& segment = segments[static_cast<std::size_t>(i)];
    const float start = g[segment.from];
    const float end = g[segment.to];
    if (segment.from == segment.to) {  // a texel wide
      points[at++] = {-(place(segment.from) - 0.499f), start};
      points[at++] = {place(segment.from) + 0.499f, start};
      continue;
    }
    if (segment.first) points[at++] = {-place(segment.from), start};
    points[at++] = {place(segment.to), end};
  }
}

/// Floats of a line in Work::lines.
std::size_t strideOf(int size) {
  return static_cast<std::size_t>(wholeLanes(size) + kLanes);
}

/// Samples of the lines j to j + kLines - 1 of a domain, by major texel. Along a column of texels
/// neighbouring lines are one texel apart: all share what they interpolate by.
CATOPTRIC_INLINE void sampleLines(const Columns& columns, const Domain& domain, int j, Work& work) {
  const int size = columns.size();
  const std::size_t stride = strideOf(size);
  work.across.resize(stride * kLines);
  work.lines.resize(stride * kLines);
  const int lines = wholeLanes(std::min(kLines, domain.count - j));
  for (int k = 0; k < static_cast<int>(stride); ++k) {
    float* const into = &work.across[static_cast<std::size_t>(k * kLines)];
    const float minor = domain.slope * (static_cast<float>(k) + 0.5f);
    const float below = std::floor(minor);
    const float f = minor - below;
    const int texel = domain.first + j + static_cast<int>(below);
    if (k >= size || texel <= -Columns::kBorder || texel + kLines >= size + Columns::kBorder) {
      std::fill_n(into, kLines, 0.0f);
      continue;
    }
    const float* const from = columns.texels() + k * columns.stride() + texel;
    const bool lower = f < 0.5f;
    CATOPTRIC_INDEPENDENT
    for (int l = 0; l < lines; ++l) {
      const float a = from[l], b = from[l + 1];
      const float between = a + f * (b - a);
      const float nearer = lower ? a : b;
      into[l] = ((a > 0.0f) & (b > 0.0f)) ? between : nearer;
    }
  }
  // Turned, 4 x 4 at a time
  for (std::size_t k = 0; k < stride; k += 4) {
    for (std::size_t line = 0; line < kLines; line += 4) {
      std::array<Floats4, 4> four;
      for (std::size_t i = 0; i < 4; ++i)
        four[i] = load<Floats4>(&work.across[(k + i) * kLines + line]);
      transpose(four[0], four[1], four[2], four[3]);
      for (std::size_t i = 0; i < 4; ++i) store(four[i], &work.lines[(line + i) * stride + k]);
    }
  }
}

/// All lines of a domain.
CATOPTRIC_INLINE void simplifyDomain(const Columns& columns, const Domain& domain, std::size_t m,
                                     std::span<Point> into, Work& work, Simplification& done) {
  const auto size = static_cast<std::size_t>(columns.size());
  for (int j = 0; j < domain.count; ++j) {
    const int line = j % kLines;
    if (line == 0) sampleLines(columns, domain, j, work);
    simplify(&work.lines[static_cast<std::size_t>(line) * strideOf(columns.size())], size,
             into.subspan(static_cast<std::size_t>(j) * m, m), work, done);
  }
}

}  // namespace

void Simplification::add(const Simplification& other) {
  samples += other.samples;
  spans += other.spans;
  lostSpans += other.lostSpans;
  lostSamples += other.lostSamples;
}

std::vector<Domain> makeDomains(int n, int size) {
  std::vector<Domain> domains;
  int offset = 0;
  for (int i = 0; i < n; ++i) {
    const double angle = static_cast<double>(kPi) * i / n;
    const double x = std::cos(angle);
    const double y = std::sin(angle);
    Domain domain;
    domain.alongX = std::abs(x) >= std::abs(y);
    domain.slope = static_cast<float>(domain.alongX ? y / x : x / y);
    // Minor positions of samples in -1/2 .. size + 1/2
    const float reach = domain.slope * static_cast<float>(size);
    domain.first = static_cast<int>(std::floor(std::min(0.0f, -reach))) - 1;
    domain.count = static_cast<int>(std::ceil(static_cast<float>(size) + std::max(0.0f, -reach))) +
                   1 - domain.first;
    domain.offset = offset;
    offset += domain.count;
    domains.push_back(domain);
  }
  return domains;
}

void buildSrdm(std::span<const float> texels, int size, std::span<const Domain> domains, int m,
               std::span<Point> into, Simplification& done) {
  const Columns across(texels, size, true);
  const Columns down(texels, size, false);
  const auto points = static_cast<std::size_t>(m);
  std::vector<Simplification> sums(domains.size());
  parallelFor(domains.size(), 1, [&](std::size_t begin, std::size_t end) {
    Work work;
    for (std::size_t d = begin; d < end; ++d) {
      const Domain& domain = domains[d];
      atVectorLevel<simplifyDomain>(domain.alongX ? across : down, domain, points,
                                    into.subspan(static_cast<std::size_t>(domain.offset) * points,
                                                 static_cast<std::size_t>(domain.count) * points),
                                    work, sums[d]);
    }
  });
  for (const Simplification& sum : sums) done.add(sum);
}

}  // namespace catoptric::methods::depth_impostors
