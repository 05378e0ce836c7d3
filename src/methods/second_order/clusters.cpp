#include "methods/second_order/clusters.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace catoptric::methods {
namespace {

constexpr float kPoleSine = 1.75e-3f;  ///< sine of 0.1 degrees; ours
/// Samples are on one plane when no normal leaves the plane's by more (radians) and none the plane
/// by more than this share of its distance from the eye: a pixel's reflection moves by less than a
/// tenth of a texel of a 1024 pixel frame. Ours.
constexpr float kPlanarNormal = 1e-4f;
constexpr float kPlanarOffset = 5e-5f;
constexpr std::uint64_t kLeastPlane = 64;     ///< samples of a planar cluster; ours
constexpr std::size_t kMostClusters = 65000;  ///< of a 16-bit index

/// Sums over a cluster's samples in one block.
struct Sums {
  glm::dvec3 position{0.0};
  glm::dvec3 normal{0.0};
  // Of positions, beyond planar mirrors: xx, yy, zz, and xy, yz, zx
  glm::dvec3 squares{0.0};
  glm::dvec3 products{0.0};
  double dot = 0.0;
  float glossiness = 0.0f;
  int left = 1 << 30, top = 1 << 30, right = 0, bottom = 0;
};

/// The plane that most samples of a bin lie on, if any does: candidate and weight of a majority
/// vote [Boyer1991].
struct Plane {
  Vec3 normal{0.0f};
  float offset = 0.0f;  ///< dot(normal, P), relative to the frame's eye
  std::int64_t votes = 0;

  bool holds(const Vec3& position, const Vec3& sampleNormal) const {
    const Vec3 turned = sampleNormal - normal;
    const float off = glm::dot(normal, position) - offset;
    return glm::dot(turned, turned) <= kPlanarNormal * kPlanarNormal &&
           off * off <= kPlanarOffset * kPlanarOffset * glm::dot(position, position);
  }
  void vote(const Plane& other) {
    const Vec3 turned = other.normal - normal;
    const bool same =
        glm::dot(turned, turned) <= kPlanarNormal * kPlanarNormal &&
        std::abs(other.offset - offset) <= kPlanarOffset * std::max(std::abs(offset), 1e-30f);
    if (same) {
      votes += other.votes;
    } else if (other.votes > votes) {
      const std::int64_t left = other.votes - votes;
      *this = other;
      votes = left;
    } else {
      votes -= other.votes;
    }
  }
};

/// Direction of the least variance; `normal` where samples are (nearly) one point or on a line.
Vec3 planeNormal(const glm::dmat3& covariance, const Vec3& normal) {
  Eigen::Matrix3d matrix;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) matrix(i, j) = covariance[i][j];
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
  const Eigen::Vector3d& values = solver.eigenvalues();
  if (solver.info() != Eigen::Success || !(values[1] > 1e-4 * values[2])) return normal;
  const Eigen::Vector3d v = solver.eigenvectors().col(0);
  const Vec3 found = normalizedOr(Vec3(v[0], v[1], v[2]), normal);
  return glm::dot(found, normal) < 0.0f ? -found : found;
}

}  // namespace

BinScale binScale(float areaFraction, int visibleObjects, const ClusterOptions& options) {
  const float scale = std::min(1.0f, options.binDensity * 100.0f * areaFraction /
                                         static_cast<float>(std::max(1, visibleObjects)));
  BinScale bins;
  bins.theta = std::max(1.0f, scale * static_cast<float>(options.maxThetaBins));
  bins.phi = std::max(1.0f, scale * static_cast<float>(options.maxPhiBins));
  bins.thetaBins = static_cast<int>(std::ceil(bins.theta));
  bins.phiBins = static_cast<int>(std::ceil(bins.phi));
  return bins;
}

int binOf(const Vec3& normal, const BinScale& scale) {
  int theta = 0;
  if (normal.x * normal.x + normal.z * normal.z > kPoleSine * kPoleSine) {
    float turn = std::atan2(normal.z, normal.x) / (2.0f * kPi);
    if (turn < 0.0f) turn += 1.0f;
    theta = std::min(scale.thetaBins - 1, static_cast<int>(turn * scale.theta));
  }
  const float fall = std::acos(std::clamp(normal.y, -1.0f, 1.0f)) / kPi;
  const int phi = std::min(scale.phiBins - 1, static_cast<int>(fall * scale.phi));
  return phi * scale.thetaBins + theta;
}

void Clustering::build(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                       std::span<const ReflectorKind> kinds, const ClusterOptions& options) {
  const int width = gbuffer.sampleWidth();
  const int height = gbuffer.sampleHeight();
  const std::size_t total = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const std::size_t blockCount = static_cast<std::size_t>((height + kRows - 1) / kRows);
  const std::size_t objects = kinds.size();
  blocks_.resize(blockCount);
  binOf_.resize(total);
  clusterOf_.resize(total);
  const bool levels = !gbuffer.diffuse.empty();
  const auto reflects = [&](std::size_t at) {
    const std::uint32_t id = gbuffer.object[at];
    return kinds[id] != ReflectorKind::None && gbuffer.depth[at] > 0.0f &&
           (!levels || gbuffer.diffuse[4 * at + 3] > 0.0f);
  };
  const auto forBlocks = [&](auto&& body) {
    parallelFor(blockCount, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        body(b, static_cast<int>(b) * kRows, std::min(height, (static_cast<int>(b) + 1) * kRows));
      }
    });
  };

  // Area of every reflective object
  forBlocks([&](std::size_t b, int top, int bottom) {
    std::vector<std::uint32_t>& counts = blocks_[b].counts;
    counts.assign(objects, 0);
    for (std::size_t at = static_cast<std::size_t>(top) * width;
         at < static_cast<std::size_t>(bottom) * width; ++at) {
      if (reflects(at)) ++counts[gbuffer.object[at]];
    }
  });
  std::vector<std::uint64_t> area(objects, 0);
  for (const Block& block : blocks_) {
    for (std::size_t i = 0; i < objects; ++i) area[i] += block.counts[i];
  }
  reflective_ = 0;
  visibleObjects_ = 0;
  for (const std::uint64_t samples : area) {
    reflective_ += samples;
    visibleObjects_ += samples > 0 ? 1 : 0;
  }

  // Bins of every visible object
  std::vector<BinScale> scales(objects);
  std::vector<std::uint32_t> firstBin(objects + 1, 0);
  for (std::size_t i = 0; i < objects; ++i) {
    std::uint32_t bins = 0;
    if (area[i] > 0) {
      scales[i] = binScale(static_cast<float>(area[i]) / static_cast<float>(total), visibleObjects_,
                           options);
      bins = static_cast<std::uint32_t>(scales[i].thetaBins * scales[i].phiBins);
    }
    firstBin[i + 1] = firstBin[i] + bins;
  }
  const std::uint32_t bins = firstBin[objects];
  constexpr std::uint32_t kNoBin = 0xFFFFFFFFu;
  const Mat3 rayFromPixel = scene::rayFromPixel(camera, width, height);
  const auto normalAt = [&](std::size_t at) {
    return Vec3(gbuffer.normal[4 * at], gbuffer.normal[4 * at + 1], gbuffer.normal[4 * at + 2]);
  };
  const Vec3 rayStep = rayFromPixel[0];
  const auto firstRay = [&](int y) {
    return rayFromPixel * Vec3(0.5f, static_cast<float>(y) + 0.5f, 1.0f);
  };
  std::vector<Plane> votes(blockCount * bins);
  forBlocks([&](std::size_t b, int top, int bottom) {
    Plane* mine = votes.data() + b * bins;
    // Neighbours on flat surfaces have one normal: its angles are computed once
    std::uint32_t lastId = 0;
    Vec3 lastNormal(0.0f);
    std::uint32_t bin = 0;
    for (int y = top; y < bottom; ++y) {
      const Vec3 rowRay = firstRay(y);
      for (int x = 0; x < width; ++x) {
        const std::size_t at = static_cast<std::size_t>(y) * width + x;
        binOf_[at] = kNoBin;
        if (!reflects(at)) continue;
        const std::uint32_t id = gbuffer.object[at];
        const Vec3 normal = normalAt(at);
        if (id != lastId || normal != lastNormal) {
          bin = firstBin[id] + static_cast<std::uint32_t>(methods::binOf(normal, scales[id]));
          lastId = id;
          lastNormal = normal;
        }
        binOf_[at] = bin;
        const Vec3 position =
            (camera.nearMetres / gbuffer.depth[at]) * (rowRay + static_cast<float>(x) * rayStep);
        Plane& plane = mine[bin];
        if (plane.votes > 0 && plane.holds(position, normal)) {
          ++plane.votes;
        } else if (plane.votes > 0) {
          --plane.votes;
        } else {
          plane = {normal, glm::dot(normal, position), 1};
        }
      }
    }
  });
  std::vector<Plane> planes(bins);
  for (std::size_t b = 0; b < blockCount; ++b) {
    for (std::uint32_t bin = 0; bin < bins; ++bin) planes[bin].vote(votes[b * bins + bin]);
  }

  // What lies on a bin's plane is a cluster of its own: numbers 2 bin (the rest) and 2 bin + 1
  forBlocks([&](std::size_t b, int top, int bottom) {
    std::vector<std::uint32_t>& counts = blocks_[b].counts;
    counts.assign(2 * std::size_t{bins}, 0);
    for (int y = top; y < bottom; ++y) {
      const Vec3 rowRay = firstRay(y);
      for (int x = 0; x < width; ++x) {
        const std::size_t at = static_cast<std::size_t>(y) * width + x;
        if (binOf_[at] == kNoBin) continue;
        const Plane& plane = planes[binOf_[at]];
        const Vec3 position =
            (camera.nearMetres / gbuffer.depth[at]) * (rowRay + static_cast<float>(x) * rayStep);
        const bool flat = plane.votes > 0 && plane.holds(position, normalAt(at));
        binOf_[at] = 2 * binOf_[at] + (flat ? 1 : 0);
        ++counts[binOf_[at]];
      }
    }
  });

  // Bins that are full enough become clusters, in the order of objects and bins
  clusters_.clear();
  unclustered_ = 0;
  std::vector<std::uint16_t> clusterOfBin(2 * std::size_t{bins}, 1);
  std::vector<std::uint64_t> filled(2 * std::size_t{bins}, 0);
  for (const Block& block : blocks_) {
    for (std::size_t bin = 0; bin < filled.size(); ++bin) filled[bin] += block.counts[bin];
  }
  for (std::size_t object = 0; object < objects; ++object) {
    for (std::uint32_t bin = firstBin[object]; bin < firstBin[object + 1]; ++bin) {
      // A plane of few samples is a facet of something curved
      const bool flat = filled[2 * bin + 1] >= kLeastPlane;
      if (!flat) {
        filled[2 * bin] += filled[2 * bin + 1];
        filled[2 * bin + 1] = 0;
      }
      for (const std::uint32_t part : {2 * bin, 2 * bin + 1}) {
        if (filled[part] == 0) continue;
        if (filled[part] < static_cast<std::uint64_t>(options.minSamples) ||
            clusters_.size() == kMostClusters) {
          unclustered_ += filled[part];
          continue;
        }
        Cluster cluster;
        cluster.object = static_cast<int>(object);
        const auto local = static_cast<int>(bin - firstBin[object]);
        cluster.thetaBin = local % scales[object].thetaBins;
        cluster.phiBin = local / scales[object].thetaBins;
        cluster.samples = static_cast<std::uint32_t>(filled[part]);
        cluster.planar = part % 2 == 1;
        clusters_.push_back(cluster);
        clusterOfBin[part] = static_cast<std::uint16_t>(clusters_.size() + 1);
      }
      if (!flat) clusterOfBin[2 * bin + 1] = clusterOfBin[2 * bin];
    }
  }

  // Samples with their rays, and sums for the means; of planar mirrors the plane says it all
  const std::size_t count = clusters_.size();
  std::vector<std::uint8_t> mirrors(count);
  for (std::size_t c = 0; c < count; ++c) {
    mirrors[c] = clusters_[c].planar && kinds[clusters_[c].object] == ReflectorKind::Mirror ? 1 : 0;
  }
  std::vector<Sums> sums(blockCount * count);
  forBlocks([&](std::size_t b, int top, int bottom) {
    Block& block = blocks_[b];
    Sums* mine = sums.data() + b * count;
    block.samples.clear();
    block.rows.clear();
    for (int y = top; y < bottom; ++y) {
      SampleRow row{block.samples.size(), 0};
      const Vec3 rowRay = firstRay(y);
      for (int x = 0; x < width; ++x) {
        const std::size_t at = static_cast<std::size_t>(y) * width + x;
        const std::uint16_t known = binOf_[at] == kNoBin ? 0 : clusterOfBin[binOf_[at]];
        clusterOf_[at] = known;
        if (known < 2) continue;
        const Vec3 ray = rowRay + static_cast<float>(x) * rayStep;
        const Vec3 position = (camera.nearMetres / gbuffer.depth[at]) * ray;
        const Vec3 normal = normalAt(at);
        const auto cluster = static_cast<std::uint16_t>(known - 2);
        Sums& s = mine[cluster];
        s.position += glm::dvec3(position);
        s.normal += glm::dvec3(normal);
        s.glossiness = std::max(s.glossiness, gbuffer.normal[4 * at + 3]);
        s.left = std::min(s.left, x);
        s.right = std::max(s.right, x + 1);
        s.top = std::min(s.top, y);
        s.bottom = std::max(s.bottom, y + 1);
        if (mirrors[cluster] != 0) continue;
        const Vec3 incoming = ray / glm::length(ray);
        block.samples.push_back({position, incoming - 2.0f * glm::dot(incoming, normal) * normal,
                                 cluster, static_cast<std::uint16_t>(x)});
        const glm::dvec3 wide(position);
        s.squares += wide * wide;
        s.products += glm::dvec3(wide.x * wide.y, wide.y * wide.z, wide.z * wide.x);
        s.dot += static_cast<double>(glm::dot(position, normal));
      }
      row.last = block.samples.size();
      block.rows.push_back(row);
    }
  });
  for (std::size_t c = 0; c < count; ++c) {
    Sums all;
    for (std::size_t b = 0; b < blockCount; ++b) {
      const Sums& s = sums[b * count + c];
      all.position += s.position;
      all.normal += s.normal;
      all.squares += s.squares;
      all.products += s.products;
      all.dot += s.dot;
      all.glossiness = std::max(all.glossiness, s.glossiness);
      all.left = std::min(all.left, s.left);
      all.right = std::max(all.right, s.right);
      all.top = std::min(all.top, s.top);
      all.bottom = std::max(all.bottom, s.bottom);
    }
    Cluster& cluster = clusters_[c];
    const double n = cluster.samples;
    const glm::dvec3 centroid = all.position / n;
    cluster.centroid = Vec3(centroid);
    cluster.concave = !cluster.planar && all.dot - n * glm::dot(centroid, all.normal / n) < 0.0;
    const glm::dvec3 mean = all.normal / n;
    cluster.normalsCancel = glm::length(mean) < 1e-3;
    cluster.meanNormal = cluster.normalsCancel
                             ? normalizedOr(-cluster.centroid, Vec3(0.0f, 1.0f, 0.0f))
                             : Vec3(glm::normalize(mean));
    cluster.planeNormal = cluster.meanNormal;
    if (mirrors[c] == 0) {
      const glm::dmat3 moment(all.squares.x, all.products.x, all.products.z,  //
                              all.products.x, all.squares.y, all.products.y,  //
                              all.products.z, all.products.y, all.squares.z);
      cluster.planeNormal =
          planeNormal(moment / n - glm::outerProduct(centroid, centroid), cluster.meanNormal);
    }
    cluster.maxGlossiness = all.glossiness;
    cluster.left = all.left;
    cluster.right = all.right;
    cluster.top = all.top;
    cluster.bottom = all.bottom;
  }
}

}  // namespace catoptric::methods
