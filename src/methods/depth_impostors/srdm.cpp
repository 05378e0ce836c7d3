#include "methods/depth_impostors/srdm.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/vector_versions.h"
#include "methods/depth_impostors/columns.h"

// Loops over samples are plain ones that the compiler turns into vector code, once for each level
// of the machine; all give the same bits.
namespace catoptric::methods::depth_impostors {
namespace {

/// A segment of a line's polyline, between two samples.
struct Segment {
  int from = 0;
  int to = 0;
  float error = 0.0f;
  int worst = 0;       ///< sample
  bool first = false;  ///< of its span
};

/// What lies in a block is asked for at once. Ours.
constexpr int kBlock = 16;

/// The largest distance of samples between two of them from the line through these. `errors`: room
/// for those of all samples and a block.
CATOPTRIC_INLINE void measure(const float* g, Segment& segment, float* errors) {
  segment.error = 0.0f;
  segment.worst = segment.from;
  const int length = segment.to - segment.from;
  if (length < 2) return;
  const float* const at = g + segment.from;
  const float start = at[0];
  const float step = (at[length] - start) / static_cast<float>(length);
  float most = 0.0f;
  CATOPTRIC_INDEPENDENT
  for (int k = 1; k < length; ++k) {
    const float error = std::abs(at[k] - (start + step * static_cast<float>(k)));
    errors[k] = error;
    most = error > most ? error : most;
  }
  if (!(most > 0.0f)) return;
  for (int k = length; k < length + kBlock; ++k) errors[k] = -1.0f;
  int block = 1;
  for (int found = 0; found == 0; block += kBlock)
    for (int k = 0; k < kBlock; ++k) found |= errors[block + k] == most ? 1 : 0;
  int worst = block - kBlock;
  while (errors[worst] != most) ++worst;
  segment.error = most;
  segment.worst = segment.from + worst;
}

struct Span {
  int from = 0;
  int to = 0;  ///< last sample
};

/// Runs of samples; of more than `most` the longest.
CATOPTRIC_INLINE void findSpans(std::span<const float> g, std::size_t most,
                                std::vector<Span>& spans, Simplification& done) {
  spans.clear();
  const int count = static_cast<int>(g.size());
  for (int k = 0; k < count; ++k) {
    if (!(g[static_cast<std::size_t>(k)] > 0.0f)) continue;
    Span span{k, k};
    while (span.to + 1 < count && g[static_cast<std::size_t>(span.to + 1)] > 0.0f) ++span.to;
    done.samples += static_cast<std::uint64_t>(span.to - span.from + 1);
    spans.push_back(span);
    k = span.to;
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

/// What simplifyLine() works with, kept from line to line.
struct Work {
  std::vector<Span> spans;
  std::vector<Segment> queue;  ///< a heap by error
  std::vector<float> samples;
  std::vector<float> errors;  ///< measure()'s
  // sampleAll()'s, by sample
  std::vector<int> places;
  std::vector<float> shares;
  std::vector<float> lower;
  std::vector<float> upper;
};

CATOPTRIC_INLINE void simplify(std::span<const float> g, std::span<Point> points, Work& work,
                               Simplification& done) {
  std::fill(points.begin(), points.end(), kUnused);
  work.errors.resize(g.size() + 2 * kBlock);
  findSpans(g, points.size() / 2, work.spans, done);
  if (work.spans.empty()) return;
  const auto smaller = [](const Segment& a, const Segment& b) {
    return a.error < b.error || (a.error == b.error && a.from > b.from);
  };
  work.queue.clear();
  for (const Span& span : work.spans) {
    Segment segment{span.from, span.to, 0.0f, 0, true};
    measure(g.data(), segment, work.errors.data());
    work.queue.push_back(segment);
  }
  std::make_heap(work.queue.begin(), work.queue.end(), smaller);
  // A split adds one point
  for (std::size_t used = 2 * work.spans.size(); used < points.size(); ++used) {
    if (!(work.queue.front().error > 0.0f)) break;
    std::pop_heap(work.queue.begin(), work.queue.end(), smaller);
    const Segment whole = work.queue.back();
    Segment left{whole.from, whole.worst, 0.0f, 0, whole.first};
    Segment right{whole.worst, whole.to, 0.0f, 0, false};
    measure(g.data(), left, work.errors.data());
    measure(g.data(), right, work.errors.data());
    work.queue.back() = left;
    std::push_heap(work.queue.begin(), work.queue.end(), smaller);
    work.queue.push_back(right);
    std::push_heap(work.queue.begin(), work.queue.end(), smaller);
  }
  std::sort(work.queue.begin(), work.queue.end(),
            [](const Segment& a, const Segment& b) { return a.from < b.from; });
  std::size_t at = 0;
  const auto place = [](int sample) { return static_cast<float>(sample) + 0.5f; };
  for (const Segment& segment : work.queue) {
    const float start = g[static_cast<std::size_t>(segment.from)];
    const float end = g[static_cast<std::size_t>(segment.to)];
    if (segment.from == segment.to) {  // a texel wide
      points[at++] = {-(place(segment.from) - 0.499f), start};
      points[at++] = {place(segment.from) + 0.499f, start};
      continue;
    }
    if (segment.first) points[at++] = {-place(segment.from), start};
    points[at++] = {place(segment.to), end};
  }
}

/// Samples of line j of a domain, by major texel.
CATOPTRIC_INLINE void sampleAll(const Columns& columns, const Domain& domain, int j, Work& work) {
  const int size = columns.size();
  work.samples.assign(static_cast<std::size_t>(size), 0.0f);
  for (std::vector<float>* lane : {&work.shares, &work.lower, &work.upper})
    lane->resize(static_cast<std::size_t>(size));
  work.places.resize(static_cast<std::size_t>(size));
  const float start = static_cast<float>(domain.first + j) + 0.5f;
  const float slope = domain.slope;
  // Texels along the major axis at which the line is over the square
  int from = 0;
  int to = size;
  if (std::abs(slope) > 1e-6f) {
    const float a = (-0.5f - start) / slope;
    const float b = (static_cast<float>(size) + 0.5f - start) / slope;
    from = std::clamp(static_cast<int>(std::floor(std::min(a, b) - 1.0f)), 0, size);
    to = std::clamp(static_cast<int>(std::ceil(std::max(a, b) + 1.0f)), 0, size);
  }
  // As Columns::at(), in three loops: only the middle one reads at scattered places
  const int stride = columns.stride();
  const auto most = static_cast<float>(size);
  int* const places = work.places.data();
  float* const shares = work.shares.data();
  float* const lower = work.lower.data();
  float* const upper = work.upper.data();
  float* const into = work.samples.data();
  CATOPTRIC_INDEPENDENT
  for (int k = from; k < to; ++k) {
    const float place = start + slope * (static_cast<float>(k) + 0.5f) + 0.5f;
    const float above = place > 0.0f ? place : 0.0f;
    const int texel = static_cast<int>(above < most ? above : most);
    places[k] = k * stride + texel;
    shares[k] = place - static_cast<float>(texel);  // beside 0..1 beyond the square
  }
  for (int k = from; k < to; ++k) {
    const float* const texel = columns.texels() + places[k];
    lower[k] = texel[0];
    upper[k] = texel[1];
  }
  CATOPTRIC_INDEPENDENT
  for (int k = from; k < to; ++k) {
    const float a = lower[k], b = upper[k], f = shares[k];
    const float between = a + f * (b - a);
    const float nearer = f < 0.5f ? a : b;
    const float value = ((a > 0.0f) & (b > 0.0f)) ? between : nearer;
    const float begun = f < 0.0f ? 0.0f : value;
    into[k] = f < 1.0f ? begun : 0.0f;
  }
}

/// All lines of a domain.
CATOPTRIC_INLINE void simplifyDomain(const Columns& columns, const Domain& domain, std::size_t m,
                                     std::span<Point> into, Work& work, Simplification& done) {
  for (int j = 0; j < domain.count; ++j) {
    sampleAll(columns, domain, j, work);
    simplify(work.samples, into.subspan(static_cast<std::size_t>(j) * m, m), work, done);
  }
}

using SimplifyDomain = void (*)(const Columns&, const Domain&, std::size_t, std::span<Point>, Work&,
                                Simplification&);

// One function for each level: a macro, as a function's target is an attribute.
// NOLINTBEGIN(bugprone-macro-parentheses): attributes take none
#define CATOPTRIC_VERSION(name, attributes)                                                 \
  namespace name {                                                                          \
  attributes void all(const Columns& c, const Domain& d, std::size_t m, std::span<Point> p, \
                      Work& w, Simplification& s) {                                         \
    simplifyDomain(c, d, m, p, w, s);                                                       \
  }                                                                                         \
  constexpr SimplifyDomain kAll = all;                                                      \
  }

CATOPTRIC_EACH_VECTOR_LEVEL(CATOPTRIC_VERSION)
#undef CATOPTRIC_VERSION
// NOLINTEND(bugprone-macro-parentheses)

/// Depth of a map's value: linear in 1 / z.
float metresOf(float g, float nearMetres, float farMetres) {
  return 1.0f / (g * (1.0f / nearMetres - 1.0f / farMetres) + 1.0f / farMetres);
}

}  // namespace

void Simplification::add(const Simplification& other) {
  samples += other.samples;
  spans += other.spans;
  lostSpans += other.lostSpans;
  lostSamples += other.lostSamples;
  errorSum += other.errorSum;
  metresSum += other.metresSum;
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

void simplifyLine(std::span<const float> samples, std::span<Point> points, Simplification& done) {
  Work work;
  simplify(samples, points, work, done);
}

void buildSrdm(std::span<const float> texels, int size, std::span<const Domain> domains, int m,
               std::span<Point> into, Simplification& done) {
  const Columns across(texels, size, true);
  const Columns down(texels, size, false);
  const auto points = static_cast<std::size_t>(m);
  const SimplifyDomain simplifies = versionOf(base::kAll, v2::kAll, v3::kAll, v4::kAll);
  std::vector<Simplification> sums(domains.size());
  parallelFor(domains.size(), 1, [&](std::size_t begin, std::size_t end) {
    Work work;
    for (std::size_t d = begin; d < end; ++d) {
      const Domain& domain = domains[d];
      simplifies(domain.alongX ? across : down, domain, points,
                 into.subspan(static_cast<std::size_t>(domain.offset) * points,
                              static_cast<std::size_t>(domain.count) * points),
                 work, sums[d]);
    }
  });
  for (const Simplification& sum : sums) done.add(sum);
}

void measureSrdm(std::span<const float> texels, int size, std::span<const Domain> domains, int m,
                 std::span<const Point> points, float nearMetres, float farMetres,
                 Simplification& done) {
  const Columns across(texels, size, true);
  const Columns down(texels, size, false);
  Work work;
  for (const Domain& domain : domains) {
    for (int j = 0; j < domain.count; ++j) {
      sampleAll(domain.alongX ? across : down, domain, j, work);
      const std::vector<float>& g = work.samples;
      const std::span<const Point> line =
          points.subspan(static_cast<std::size_t>(domain.offset + j) * static_cast<std::size_t>(m),
                         static_cast<std::size_t>(m));
      for (std::size_t p = 1; p < line.size(); ++p) {
        if (line[p].x < 0.0f) continue;
        const float from = std::abs(line[p - 1].x);
        const float to = line[p].x;
        // Each sample once: the segment's last one belongs to the next segment of its span
        const bool last = p + 1 == line.size() || line[p + 1].x < 0.0f;
        for (int k = static_cast<int>(std::ceil(from - 0.5f));
             static_cast<float>(k) + 0.5f < to + (last ? 0.001f : -0.001f); ++k) {
          const float value = g[static_cast<std::size_t>(k)];
          const float share = (static_cast<float>(k) + 0.5f - from) / (to - from);
          const float kept = line[p - 1].y + share * (line[p].y - line[p - 1].y);
          const float z = metresOf(value, nearMetres, farMetres);
          const float error = std::abs(z - metresOf(kept, nearMetres, farMetres));
          done.errorSum += error / (farMetres - nearMetres);
          done.metresSum += error / z;
        }
      }
    }
  }
}

}  // namespace catoptric::methods::depth_impostors
