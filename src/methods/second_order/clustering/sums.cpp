#include "methods/second_order/clustering/sums.h"

#include <Eigen/Eigenvalues>

namespace catoptric::methods::second_order {
namespace {

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

void describe(const Sums& all, const Vec3& anchor, Cluster& cluster) {
  const double n = all.samples;
  const glm::dvec3 offset = all.position / n;
  const glm::dvec3 mean = all.normal / n;
  cluster.samples = all.samples;
  cluster.centroid = Vec3(glm::dvec3(anchor) + offset);
  cluster.concave = !cluster.planar && all.dot - n * glm::dot(offset, mean) < 0.0;
  cluster.normalsCancel = glm::length(mean) < 1e-3;
  cluster.meanNormal = cluster.normalsCancel
                           ? normalizedOr(-cluster.centroid, Vec3(0.0f, 1.0f, 0.0f))
                           : Vec3(glm::normalize(mean));
  const glm::dmat3 moment(all.squares.x, all.products.x, all.products.z,  //
                          all.products.x, all.squares.y, all.products.y,  //
                          all.products.z, all.products.y, all.squares.z);
  cluster.planeNormal = cluster.planar ? cluster.meanNormal
                                       : planeNormal(moment / n - glm::outerProduct(offset, offset),
                                                     cluster.meanNormal);
  cluster.widestLobe = {all.lobe};
  cluster.left = all.left;
  cluster.right = all.right;
  cluster.top = all.top;
  cluster.bottom = all.bottom;
}

}  // namespace catoptric::methods::second_order
