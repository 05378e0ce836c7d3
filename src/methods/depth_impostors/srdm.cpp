#include "methods/depth_impostors/srdm.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace catoptric::methods::depth_impostors {
namespace {

/// A map's texels, those along the minor axis one after another, background before and after them.
class Columns {
 public:
  Columns(std::span<const float> texels, int size, bool alongX)
      : size_(size), stride_(static_cast<std::size_t>(size) + 2) {
    const auto n = static_cast<std::size_t>(size);
    texels_.assign(n * stride_, 0.0f);
    for (std::size_t y = 0; y < n; ++y)
      for (std::size_t x = 0; x < n; ++x)
        texels_[alongX ? x * stride_ + y + 1 : y * stride_ + x + 1] = texels[y * n + x];
  }

  int size() const { return size_; }

  /// Depth between texels at a texel's centre along the major axis: of two texels by linear
  /// interpolation, of one where the other is background, else 0.
  float at(int major, float minor) const {
    const float place = minor + 0.5f;
    if (!(place >= 0.0f && place < static_cast<float>(size_ + 1))) return 0.0f;
    const int j = static_cast<int>(place);
    const float f = place - static_cast<float>(j);
    const float* texel =
        &texels_[static_cast<std::size_t>(major) * stride_ + static_cast<std::size_t>(j)];
    if (texel[0] > 0.0f && texel[1] > 0.0f) return texel[0] + f * (texel[1] - texel[0]);
    return f < 0.5f ? texel[0] : texel[1];
  }

 private:
  int size_;
  std::size_t stride_;
  std::vector<float> texels_;
};

/// A segment of a line's polyline, between two samples.
struct Segment {
  int from = 0;
  int to = 0;
  float error = 0.0f;
  int worst = 0;       ///< sample
  bool first = false;  ///< of its span
};

/// The largest distance of samples between two of them from the line through these.
void measure(std::span<const float> g, Segment& segment) {
  segment.error = 0.0f;
  segment.worst = segment.from;
  const int length = segment.to - segment.from;
  if (length < 2) return;
  const float start = g[static_cast<std::size_t>(segment.from)];
  const float step = (g[static_cast<std::size_t>(segment.to)] - start) / static_cast<float>(length);
  const float* at = &g[static_cast<std::size_t>(segment.from)];
  float most = 0.0f;
  for (int k = 1; k < length; ++k)
    most = std::max(most, std::abs(at[k] - (start + step * static_cast<float>(k))));
  if (!(most > 0.0f)) return;
  for (int k = 1; k < length; ++k) {
    if (std::abs(at[k] - (start + step * static_cast<float>(k))) == most) {
      segment.error = most;
      segment.worst = segment.from + k;
      return;
    }
  }
}

struct Span {
  int from = 0;
  int to = 0;  ///< last sample
};

/// Runs of samples; of more than `most` the longest.
void findSpans(std::span<const float> g, std::size_t most, std::vector<Span>& spans,
               Simplification& done) {
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
};

void simplify(std::span<const float> g, std::span<Point> points, Work& work, Simplification& done) {
  std::fill(points.begin(), points.end(), kUnused);
  findSpans(g, points.size() / 2, work.spans, done);
  if (work.spans.empty()) return;
  const auto smaller = [](const Segment& a, const Segment& b) {
    return a.error < b.error || (a.error == b.error && a.from > b.from);
  };
  work.queue.clear();
  for (const Span& span : work.spans) {
    Segment segment{span.from, span.to, 0.0f, 0, true};
    measure(g, segment);
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
    measure(g, left);
    measure(g, right);
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
void sampleAll(const Columns& columns, const Domain& domain, int j, std::vector<float>& g) {
  const int size = columns.size();
  g.assign(static_cast<std::size_t>(size), 0.0f);
  const float start = static_cast<float>(domain.first + j) + 0.5f;
  // Texels along the major axis at which the line is over the square
  int from = 0;
  int to = size;
  if (std::abs(domain.slope) > 1e-6f) {
    const float a = (-0.5f - start) / domain.slope;
    const float b = (static_cast<float>(size) + 0.5f - start) / domain.slope;
    from = std::clamp(static_cast<int>(std::floor(std::min(a, b) - 1.0f)), 0, size);
    to = std::clamp(static_cast<int>(std::ceil(std::max(a, b) + 1.0f)), 0, size);
  }
  for (int k = from; k < to; ++k)
    g[static_cast<std::size_t>(k)] =
        columns.at(k, start + domain.slope * (static_cast<float>(k) + 0.5f));
}

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
  std::vector<Simplification> sums(domains.size());
  parallelFor(domains.size(), 1, [&](std::size_t begin, std::size_t end) {
    Work work;
    std::vector<float> g;
    for (std::size_t d = begin; d < end; ++d) {
      const Domain& domain = domains[d];
      for (int j = 0; j < domain.count; ++j) {
        sampleAll(domain.alongX ? across : down, domain, j, g);
        simplify(g, into.subspan(static_cast<std::size_t>(domain.offset + j) * points, points),
                 work, sums[d]);
      }
    }
  });
  for (const Simplification& sum : sums) done.add(sum);
}

void measureSrdm(std::span<const float> texels, int size, std::span<const Domain> domains, int m,
                 std::span<const Point> points, float nearMetres, float farMetres,
                 Simplification& done) {
  const Columns across(texels, size, true);
  const Columns down(texels, size, false);
  std::vector<float> g;
  for (const Domain& domain : domains) {
    for (int j = 0; j < domain.count; ++j) {
      sampleAll(domain.alongX ? across : down, domain, j, g);
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
