#include "methods/perturbation/virtual_objects.h"

#include "methods/perturbation/borders.h"
#include "methods/perturbation/edge_table.h"
#include "methods/perturbation/refinement.h"
#include "methods/perturbation/vertex_table.h"
#include "methods/perturbation/virtual_output.h"

namespace catoptric::methods::perturbation {

void TriangleCounts::add(const TriangleCounts& other) {
  paths.add(other.paths);
  vertices += other.vertices;
  triangles += other.triangles;
  dropped += other.dropped;
  coarse += other.coarse;
}

void virtualTriangles(const frame::Geometry& geometry, int object, const Reflector& reflector,
                      bool own, const View& view, Order order, const TriangleOptions& options,
                      Connectivity& known, TriangleCounts& counts, VirtualTriangles& result) {
  const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
  VertexTable table(reflector, view);
  VirtualOutput output(table, reflector.before() != nullptr, result);
  Refinement refinement(reflector, order, own, options, table, output, counts);
  table.begin(geometry, range);
  refinement.lookUpMesh();
  if (known.placeOf != table.meshPlaces()) {
    known.triangles.resize(range.indexCount / 3);
    for (std::size_t t = 0; t < known.triangles.size(); ++t) {
      for (std::size_t c = 0; c < 3; ++c) {
        known.triangles[t][c] = geometry.indices[range.firstIndex + 3 * t + c] - range.firstVertex;
      }
    }
    known.edges = edgesOf(table, known.triangles);
    known.placeOf = table.meshPlaces();
  }
  refinement.findBlindEdges(range.bounds, known.edges.ends);
  const int halvings = refinement.halvings();
  std::vector<Connectivity::Triangle> pieces =
      refinement.halve(known.triangles, known.edges, halvings > 0);
  for (int level = 1; !pieces.empty(); ++level)
    pieces = refinement.halve(pieces, edgesOf(table, pieces), level < halvings);
  Borders(reflector, table, output, counts).put(refinement.mixedTriangles());
  counts.vertices += table.places.size();
  counts.triangles += output.triangleCount();
  output.finish(object);
}

}  // namespace catoptric::methods::perturbation
