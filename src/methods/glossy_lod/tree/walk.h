// The traversal of V::kLanes rays. Only traversal.cpp includes this file, once for each vector
// type V. NOLINT(llvm-header-guard)

struct Three {
  V::F of[3];
  CATOPTRIC_WALK V::F& operator[](int i) { return of[i]; }
  CATOPTRIC_WALK const V::F& operator[](int i) const { return of[i]; }
};

/// The kind of each ray: the signs of its direction's components, and its longest axis. Each of the
/// five masks has one bit per lane.
struct KindBits {
  std::array<unsigned, 3> negative;
  std::array<unsigned, 2> axis;  // the longest axis is x, is y

  Kind of(unsigned lane) const {
    Kind kind{(axis[0] >> lane & 1u) != 0 ? 0 : (axis[1] >> lane & 1u) != 0 ? 1 : 2, 0};
    for (std::size_t i = 0; i < 3; ++i) kind.negative |= (negative[i] >> lane & 1u) << i;
    return kind;
  }
  /// Lanes of the same kind as `lane`.
  unsigned like(unsigned lane) const {
    unsigned lanes = ~0u;
    for (const unsigned set : {negative[0], negative[1], negative[2], axis[0], axis[1]})
      lanes &= (set >> lane & 1u) != 0 ? set : ~set;
    return lanes;
  }
};

CATOPTRIC_TARGET inline KindBits kindsOf(const Walk& walk) {
  Three size;
  KindBits kinds;
  for (int i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    const V::F direction = V::load(walk.packet.direction[axis].data() + walk.first);
    kinds.negative[axis] = V::bits(V::le(direction, V::all(-kTiny)));
    size[i] = V::magnitude(direction);
  }
  kinds.axis[0] = V::bits(V::both(V::le(size[1], size[0]), V::le(size[2], size[0])));
  kinds.axis[1] = V::bits(V::le(size[2], size[1])) & ~kinds.axis[0];
  return kinds;
}

/// Rays of one kind, or (kMixed) of several. The longest axis is the last coordinate.
template <bool kMixed>
struct Rays {
  Three origin;   // x, y, z
  Three inverse;  // 1 / direction
  Three shear;    // [Woop2013]
  // for one kind: the axis that is first, second and third after the permutation
  std::array<int, 3> turned;
  V::M alongX, alongY;  // for several kinds: rays whose longest axis is x, y
  V::M forwards;        // rays with a positive direction along their longest axis

  CATOPTRIC_WALK V::F choose(V::F x, V::F y, V::F z) const {
    return V::pick(alongX, x, V::pick(alongY, y, z));
  }
  /// Permutes the components of a point.
  CATOPTRIC_WALK Three turn(const Three& at) const {
    if constexpr (!kMixed) return {at[turned[0]], at[turned[1]], at[turned[2]]};
    return {choose(at[1], at[2], at[0]), choose(at[2], at[0], at[1]), choose(at[0], at[1], at[2])};
  }
};

/// The nearest hit so far.
struct Nearest {
  V::F metres, u, v;
  V::I node;
  V::M back;
};

template <bool kMixed>
CATOPTRIC_TARGET inline Rays<kMixed> raysOf(const Walk& walk, const Kind& kind) {
  Rays<kMixed> rays;
  Three direction;
  for (int i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    rays.origin[i] = V::load(walk.packet.origin[axis].data() + walk.first);
    direction[i] = V::load(walk.packet.direction[axis].data() + walk.first);
    const V::M tiny = V::lt(V::magnitude(direction[i]), V::all(kTiny));
    rays.inverse[i] = V::div(V::all(1.0f), V::pick(tiny, V::all(kTiny), direction[i]));
  }
  if constexpr (kMixed) {
    const KindBits kinds = kindsOf(walk);
    rays.alongX = V::fromBits(kinds.axis[0]);
    rays.alongY = V::fromBits(kinds.axis[1]);
  } else {
    rays.turned = {(kind.axis + 1) % 3, (kind.axis + 2) % 3, kind.axis};
  }
  const Three turned = rays.turn(direction);
  rays.shear[0] = V::div(turned[0], turned[2]);
  rays.shear[1] = V::div(turned[1], turned[2]);
  rays.shear[2] = V::div(V::all(1.0f), turned[2]);
  rays.forwards = V::lt(V::all(0.0f), turned[2]);
  return rays;
}

/// A vertex in the coordinates of the watertight test [Woop2013], in which rays run along z.
template <bool kMixed>
CATOPTRIC_WALK Three sheared(const Rays<kMixed>& rays, const Vec4& vertex) {
  const Three place =
      rays.turn({V::sub(V::all(vertex.x), rays.origin[0]), V::sub(V::all(vertex.y), rays.origin[1]),
                 V::sub(V::all(vertex.z), rays.origin[2])});
  return {V::sub(place[0], V::mul(rays.shear[0], place[2])),
          V::sub(place[1], V::mul(rays.shear[1], place[2])), V::mul(rays.shear[2], place[2])};
}

/// Hits of lanes on one triangle of a quad.
struct Met {
  V::F metres, u, v;
  V::M hit, back;
};

CATOPTRIC_WALK Met meetTriangle(const Three& a, const Three& b, const Three& c, V::F limit,
                                V::M lanes) {
  const V::F zero = V::all(0.0f);
  // A shared edge gives both its triangles the same number, except for the sign
  const V::F u = V::sub(V::mul(c[0], b[1]), V::mul(c[1], b[0]));
  const V::F v = V::sub(V::mul(a[0], c[1]), V::mul(a[1], c[0]));
  const V::F w = V::sub(V::mul(b[0], a[1]), V::mul(b[1], a[0]));
  const V::F low = V::least(V::least(u, v), w);
  const V::F high = V::most(V::most(u, v), w);
  const V::M inside = V::either(V::le(zero, low), V::le(high, zero));
  Met met;
  met.hit = V::both(lanes, inside);
  if (V::bits(met.hit) == 0) return met;
  const V::F facing = V::add(V::add(u, v), w);
  met.metres = V::div(V::add(V::add(V::mul(u, a[2]), V::mul(v, b[2])), V::mul(w, c[2])), facing);
  met.u = V::div(v, facing);
  met.v = V::div(w, facing);
  met.back = V::lt(facing, zero);
  const V::M flat = V::both(V::le(facing, zero), V::le(zero, facing));
  met.hit = V::both(V::without(met.hit, flat),
                    V::both(V::lt(zero, met.metres), V::lt(met.metres, limit)));
  return met;
}

/// Lanes whose rays start on the object of a node's quad.
CATOPTRIC_WALK V::M ofOwnObject(const Walk& walk, std::uint32_t node) {
  const V::I object = V::all(walk.tree.objects[walk.tree.quads[node].chart]);
  const V::I own = V::load(walk.packet.own.data() + walk.first);
  return V::both(V::le(own, object), V::le(object, own));
}

/// The rays of `lanes` all hit this triangle, which belongs to the object on which they start.
/// Returns the rays that must ignore the hit: it is low above their starting surface (kStartQuads),
/// and lies on the triangle's back or on a front that continues this surface (kStartCosine).
inline unsigned ofStart(const Walk& walk, std::uint32_t node, bool upper, unsigned lanes,
                        unsigned backs, const std::array<float, V::kLanes>& metres) {
  const Quad& quad = walk.tree.quads[node];
  const std::uint32_t right = 1u << (quad.place >> 24);
  const Vec4* const v = walk.tree.vertices + quad.first;
  const Vec3 corner(upper ? v[quad.up + right] : v[0]);
  const Vec3 normal = glm::cross(Vec3(v[right]) - corner, Vec3(v[quad.up]) - corner);
  const float least = kStartCosine * glm::length(normal);
  const Node& box = walk.tree.nodes[node];
  const float above = kStartQuads * glm::distance(box.least, box.most);
  const RayPacket& packet = walk.packet;
  unsigned found = 0;
  for (std::size_t lane = 0; lane < V::kLanes; ++lane) {
    if ((lanes >> lane & 1u) == 0) continue;
    const std::size_t i = walk.first + lane;
    const Vec3 leaves(packet.leaves[0][i], packet.leaves[1][i], packet.leaves[2][i]);
    const Vec3 way(packet.direction[0][i], packet.direction[1][i], packet.direction[2][i]);
    if (metres[lane] * glm::dot(way, leaves) > above) continue;
    // On the side that the ray hits, the normal points against the ray
    const float cosine =
        glm::dot(normal, way) > 0.0f ? -glm::dot(normal, leaves) : glm::dot(normal, leaves);
    if ((backs >> lane & 1u) != 0 || cosine <= -least) found |= 1u << lane;
  }
  return found;
}

/// Lanes that ignore a triangle, because it belongs to the object on which their rays start.
CATOPTRIC_TARGET inline unsigned passedBy(const Walk& walk, std::uint32_t node, bool upper,
                                          const Met& met, V::M back) {
  unsigned own = V::bits(V::both(met.hit, ofOwnObject(walk, node)));
  if (own == 0) return 0;
  const Node& box = walk.tree.nodes[node];
  own &= V::bits(V::lt(met.metres, V::all(kOwnQuads * glm::distance(box.least, box.most))));
  if (own == 0) return 0;
  std::array<float, V::kLanes> metres;
  V::store(metres.data(), met.metres);
  return ofStart(walk, node, upper, own, V::bits(back), metres);
}

/// Keeps the hits on one triangle that are nearest so far. `fronts`: hits on the triangle's back do
/// not count, so these rays continue in the finer quads. A ray that slips through a crack between
/// coarse quads can hit a back that the true surface hides.
template <bool kMixed>
CATOPTRIC_TARGET inline void keep(const Walk& walk, const Rays<kMixed>& rays, std::uint32_t node,
                                  bool upper, bool fronts, Met& met, Nearest& nearest) {
  if (V::bits(met.hit) == 0) return;
  if (upper) {
    met.u = V::sub(V::all(1.0f), met.u);
    met.v = V::sub(V::all(1.0f), met.v);
  }
  const bool folds = (walk.tree.nodes[node].flags & (upper ? kUpperFolds : kLowerFolds)) != 0;
  const V::M front = V::without(met.hit, met.back);
  const V::M back = V::either(V::both(folds ? front : met.back, rays.forwards),
                              V::without(folds ? met.back : front, rays.forwards));
  if (fronts) met.hit = V::without(met.hit, back);
  const unsigned passed = passedBy(walk, node, upper, met, back);
  if (passed != 0) {
    walk.visits.ownBacks += static_cast<std::uint64_t>(__builtin_popcount(passed));
    met.hit = V::without(met.hit, V::fromBits(passed));
  }
  const AlphaTest& test = walk.tree.alphaTest;
  if (test.isCut != nullptr) {
    std::array<float, V::kLanes> u;
    std::array<float, V::kLanes> v;
    V::store(u.data(), met.u);
    V::store(v.data(), met.v);
    unsigned hit = V::bits(met.hit);
    for (std::size_t lane = 0; lane < V::kLanes; ++lane)
      if ((hit >> lane & 1u) != 0 && test.isCut(test.of, node, {u[lane], v[lane]}))
        hit &= ~(1u << lane);
    met.hit = V::fromBits(hit);
  }
  nearest.metres = V::pick(met.hit, met.metres, nearest.metres);
  nearest.u = V::pick(met.hit, met.u, nearest.u);
  nearest.v = V::pick(met.hit, met.v, nearest.v);
  nearest.node = V::pick(met.hit, V::all(node), nearest.node);
  nearest.back = V::either(V::without(nearest.back, met.hit), V::both(met.hit, back));
}

/// Intersects the lanes with the two triangles of a node's quad.
template <bool kMixed>
CATOPTRIC_TARGET inline void meetQuad(const Walk& walk, const Rays<kMixed>& rays,
                                      std::uint32_t node, V::M lanes, bool fronts,
                                      Nearest& nearest) {
  const Quad& quad = walk.tree.quads[node];
  const std::uint32_t right = 1u << (quad.place >> 24);
  const Vec4* const v = walk.tree.vertices + quad.first;
  const Three v10 = sheared(rays, v[right]);
  const Three v01 = sheared(rays, v[quad.up]);
  Met met = meetTriangle(sheared(rays, v[0]), v10, v01, nearest.metres, lanes);
  keep(walk, rays, node, false, fronts, met, nearest);
  met = meetTriangle(sheared(rays, v[quad.up + right]), v01, v10, nearest.metres, lanes);
  keep(walk, rays, node, true, fronts, met, nearest);
}

/// Lanes whose width does not require anything finer than this node [Yu2008]: Eqs. (6), (7) without
/// their divisions.
template <bool kMixed>
CATOPTRIC_WALK V::M wideEnough(const Walk& walk, const Rays<kMixed>& rays, const Node& node) {
  const Vec3 size = node.most - node.least;
  const Vec3 centre = 0.5f * (node.least + node.most);
  const float quarter = 0.25f * kPi * (size.x * size.x + size.y * size.y + size.z * size.z);
  const V::F x = V::sub(V::all(centre.x), rays.origin[0]);
  const V::F y = V::sub(V::all(centre.y), rays.origin[1]);
  const V::F z = V::sub(V::all(centre.z), rays.origin[2]);
  const V::F metres = V::root(V::add(V::add(V::mul(x, x), V::mul(y, y)), V::mul(z, z)));
  const V::F base = V::load(walk.packet.base.data() + walk.first);
  const V::F slope =
      V::least(V::load(walk.packet.slope.data() + walk.first), V::all(walk.packet.steepest));
  const V::F wide = V::mul(V::all(walk.alpha), V::add(base, V::mul(slope, metres)));
  return V::le(V::all(quarter), V::mul(wide, wide));
}

/// Distances (metres) at which rays cross a plane perpendicular to an axis.
template <bool kMixed>
CATOPTRIC_WALK V::F along(const Rays<kMixed>& rays, int axis, float plane) {
  return V::mul(V::sub(V::all(plane), rays.origin[axis]), rays.inverse[axis]);
}

/// Distances (metres) at which rays enter and leave a box.
struct Passage {
  V::F enters, leaves;
};

/// For rays of one kind: offsets (in floats of a node) of a box's nearer and farther sides.
struct Sides {
  std::array<std::size_t, 3> nearer;
  std::array<std::size_t, 3> farther;
};

template <bool kMixed>
CATOPTRIC_WALK Passage passage(const Rays<kMixed>& rays, const Sides& sides, const Node& box) {
  const float* const side = &box.least.x;
  Three enters;
  Three leaves;
  for (int i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    enters[i] = along(rays, i, side[sides.nearer[axis]]);
    leaves[i] = along(rays, i, side[sides.farther[axis]]);
    if constexpr (kMixed) {
      const V::F first = V::least(enters[i], leaves[i]);
      leaves[i] = V::most(enters[i], leaves[i]);
      enters[i] = first;
    }
  }
  return {V::most(V::most(enters[0], enters[1]), enters[2]),
          V::mul(V::least(V::least(leaves[0], leaves[1]), leaves[2]), V::all(kSlack))};
}

template <Levels kLevels, bool kMixed>
CATOPTRIC_TARGET void walkLanes(const Walk& walk, const Kind& kind, unsigned lanes) {
  const Rays<kMixed> rays = raysOf<kMixed>(walk, kind);
  const Node* const nodes = walk.tree.nodes;
  const std::uint32_t count = walk.tree.count;
  const V::F zero = V::all(0.0f);
  Sides sides;
  for (std::size_t i = 0; i < 3; ++i) {
    const bool negative = (kind.negative >> i & 1u) != 0;
    sides.nearer[i] = i + (negative ? 4 : 0);
    sides.farther[i] = i + (negative ? 0 : 4);
  }
  Nearest nearest{V::all(kFarthest), zero, zero, V::all(kNothing), V::fromBits(0)};
  // The node at which a lane continues; it ignores all nodes before
  V::I next = V::pick(V::fromBits(lanes), V::all(0u),
                      V::all(static_cast<std::uint32_t>(std::numeric_limits<int>::max())));
  std::uint64_t visited = 0;
  std::uint64_t tested = 0;
  std::uint64_t stopped = 0;
  for (std::uint32_t node = 0; node < count;) {
    const Node& box = nodes[node];
    __builtin_prefetch(nodes + box.miss);
    const V::M active = V::le(next, V::all(node));
    const auto [enters, leaves] = passage(rays, sides, box);
    const V::M hit = V::both(V::both(active, V::le(V::most(enters, zero), leaves)),
                             V::le(enters, nearest.metres));
    visited += static_cast<std::uint64_t>(__builtin_popcount(V::bits(active)));
    if (V::bits(hit) == 0) {
      node = box.miss;
      continue;
    }
    V::M stop = hit;
    const bool leaf = (box.flags & kIsLeaf) != 0;
    if (!leaf) {
      stop = V::fromBits(0);
      if constexpr (kLevels != Levels::Off) {
        // Never stop at a box that contains the ray's origin
        if ((box.flags & kHasQuad) != 0)
          stop = V::both(V::both(hit, V::lt(zero, enters)), wideEnough(walk, rays, box));
        stopped += static_cast<std::uint64_t>(__builtin_popcount(V::bits(stop)));
      }
    }
    if (V::bits(stop) != 0) {
      tested += static_cast<std::uint64_t>(__builtin_popcount(V::bits(stop)));
      meetQuad(walk, rays, node, stop, kLevels == Levels::Stitched && !leaf, nearest);
      // Rays that miss a coarse quad continue in the finer quads below it
      if constexpr (kLevels == Levels::Stitched) {
        const V::I here = V::all(node);
        if (!leaf)
          stop = V::both(stop, V::both(V::le(nearest.node, here), V::le(here, nearest.node)));
      }
    }
    const V::M down = V::without(hit, stop);
    if (V::bits(down) == 0) {
      node = box.miss;
      continue;
    }
    next = V::pick(V::without(active, down), V::all(box.miss), next);
    ++node;
  }
  walk.visits.nodes += visited;
  walk.visits.quads += tested;
  walk.visits.stopped += stopped;
  V::store(walk.hits.metres.data() + walk.first, nearest.metres);
  V::store(walk.hits.node.data() + walk.first, nearest.node);
  V::store(walk.hits.u.data() + walk.first, nearest.u);
  V::store(walk.hits.v.data() + walk.first, nearest.v);
  V::store(walk.hits.back.data() + walk.first, V::pick(nearest.back, V::all(1u), V::all(0u)));
}

template <Levels kLevels>
CATOPTRIC_TARGET void walkAll(Walk walk) {
  for (; walk.first < walk.packet.count; walk.first += V::kLanes) {
    const std::size_t count = std::min(V::kLanes, walk.packet.count - walk.first);
    const KindBits kinds = kindsOf(walk);
    const unsigned lanes = ~0u >> (32 - count);
    const Kind kind = kinds.of(0);
    if ((kinds.like(0) & lanes) == lanes)
      walkLanes<kLevels, false>(walk, kind, lanes);
    else
      walkLanes<kLevels, true>(walk, {}, lanes);
  }
}

CATOPTRIC_TARGET void walkAll(const Walk& walk, Levels levels) {
  switch (levels) {
    case Levels::Adaptive:
      return walkAll<Levels::Adaptive>(walk);
    case Levels::Stitched:
      return walkAll<Levels::Stitched>(walk);
    case Levels::Off:
      break;
  }
  walkAll<Levels::Off>(walk);
}
