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

/// Hits of lanes on one triangle of a quad, between `beyond` and `limit` metres.
struct Met {
  V::F metres, u, v;
  V::M hit, back;
};

CATOPTRIC_WALK Met meetTriangle(const Three& a, const Three& b, const Three& c, V::F beyond,
                                V::F limit, V::M lanes) {
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
                    V::both(V::lt(beyond, met.metres), V::lt(met.metres, limit)));
  return met;
}

/// Lanes whose rays leave the object of a node's quad.
CATOPTRIC_WALK V::M ofOwnObject(const Walk& walk, std::uint32_t node) {
  const V::I object = V::all(walk.tree.objects[walk.tree.quads[node].chart]);
  const V::I own = V::load(walk.packet.own.data() + walk.first);
  return V::both(V::le(own, object), V::le(object, own));
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

/// The corners of a quad's triangles.
struct Corners {
  Three v00, v10, v01, v11;
};

template <bool kMixed>
CATOPTRIC_WALK Corners cornersOf(const Walk& walk, const Rays<kMixed>& rays, std::uint32_t node) {
  const Quad& quad = walk.tree.quads[node];
  const std::uint32_t right = 1u << (quad.place >> 24);
  const Vec4* const v = walk.tree.vertices + quad.first;
  return {sheared(rays, v[0]), sheared(rays, v[right]), sheared(rays, v[quad.up]),
          sheared(rays, v[quad.up + right])};
}

/// Intersects the lanes with the two triangles of a node's quad.
template <bool kMixed>
CATOPTRIC_TARGET inline void meetQuad(const Walk& walk, const Rays<kMixed>& rays,
                                      std::uint32_t node, V::M lanes, bool fronts,
                                      Nearest& nearest) {
  const V::F beyond = V::load(walk.packet.beyond.data() + walk.first);
  const Corners at = cornersOf(walk, rays, node);
  Met met = meetTriangle(at.v00, at.v10, at.v01, beyond, nearest.metres, lanes);
  keep(walk, rays, node, false, fronts, met, nearest);
  met = meetTriangle(at.v11, at.v01, at.v10, beyond, nearest.metres, lanes);
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

inline Sides sidesOf(const Kind& kind) {
  Sides sides;
  for (std::size_t i = 0; i < 3; ++i) {
    const bool negative = (kind.negative >> i & 1u) != 0;
    sides.nearer[i] = i + (negative ? 4 : 0);
    sides.farther[i] = i + (negative ? 0 : 4);
  }
  return sides;
}

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
  const Sides sides = sidesOf(kind);
  const V::F beyond = V::load(walk.packet.beyond.data() + walk.first);
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
    const V::M hit = V::both(V::both(active, V::le(V::most(enters, beyond), leaves)),
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

/// Crossings of lines with the images of their own objects, by the side of the surface that they
/// lead through. Metres along the lines.
struct Crossings {
  V::F nearest;  // distance of the nearest crossing
  V::M back;     // that is through the back
  // by side: the highest crossing, and the lowest above the lines' origins
  std::array<V::F, 2> highest, lowest;

  CATOPTRIC_WALK void add(const Met& met, V::M forwards) {
    const V::M lanes = met.hit;
    if (V::bits(lanes) == 0) return;
    const V::F metres = met.metres;
    const V::M throughBack =
        V::either(V::both(met.back, forwards), V::without(V::without(lanes, met.back), forwards));
    const V::F distance = V::magnitude(metres);
    const V::M nearer = V::both(lanes, V::lt(distance, nearest));
    nearest = V::pick(nearer, distance, nearest);
    back = V::either(V::without(back, nearer), V::both(nearer, throughBack));
    const V::M above = V::lt(V::all(0.0f), metres);
    for (std::size_t side = 0; side < 2; ++side) {
      const V::M through = side == 1 ? V::both(lanes, throughBack) : V::without(lanes, throughBack);
      highest[side] = V::pick(through, V::most(metres, highest[side]), highest[side]);
      lowest[side] = V::pick(V::both(through, above), V::least(metres, lowest[side]), lowest[side]);
    }
  }
};

/// The walk of crossOwnImages().
template <bool kMixed>
CATOPTRIC_TARGET void crossLanes(const Walk& walk, const Kind& kind, unsigned lanes,
                                 const NodeRange& nodes, float boxes, OwnCrossings& crossings) {
  const Rays<kMixed> rays = raysOf<kMixed>(walk, kind);
  const Sides sides = sidesOf(kind);
  const V::F far = V::all(kNoCrossing);
  const V::F farBehind = V::all(-kNoCrossing);
  Crossings found{far, V::fromBits(0), {farBehind, farBehind}, {far, far}};
  V::I next = V::pick(V::fromBits(lanes), V::all(0u),
                      V::all(static_cast<std::uint32_t>(std::numeric_limits<int>::max())));
  std::uint64_t visited = 0;
  for (std::uint32_t node = nodes.first; node < nodes.end;) {
    const Node& box = walk.tree.nodes[node];
    const V::M active = V::le(next, V::all(node));
    const auto [enters, leaves] = passage(rays, sides, box);
    const Vec3 size = box.most - box.least;
    const float reach = boxes * (size.x + size.y + size.z);
    // passage() lengthens the way to a side in front of the origin, and shortens that to one behind
    const V::F last = V::add(leaves, V::mul(V::magnitude(leaves), V::all(2.0f * (kSlack - 1.0f))));
    const V::M hit = V::both(V::both(active, V::le(enters, last)),
                             V::both(V::le(enters, V::all(reach)), V::le(V::all(-reach), last)));
    visited += static_cast<std::uint64_t>(__builtin_popcount(V::bits(active)));
    if (V::bits(hit) == 0) {
      node = box.miss;
      continue;
    }
    if ((box.flags & kIsLeaf) == 0) {
      next = V::pick(V::without(active, hit), V::all(box.miss), next);
      ++node;
      continue;
    }
    const V::M own = V::both(hit, ofOwnObject(walk, node));
    if (V::bits(own) != 0) {
      const Corners at = cornersOf(walk, rays, node);
      // Between layers that fold over there is one with its front on the surface's front
      if ((box.flags & kLowerFolds) == 0)
        found.add(meetTriangle(at.v00, at.v10, at.v01, V::all(-reach), V::all(reach), own),
                  rays.forwards);
      if ((box.flags & kUpperFolds) == 0)
        found.add(meetTriangle(at.v11, at.v01, at.v10, V::all(-reach), V::all(reach), own),
                  rays.forwards);
    }
    node = box.miss;
  }
  walk.visits.nodes += visited;
  // Of layers that fold over one another, up to another part of the object, the highest counts
  const V::F zero = V::all(0.0f);
  const V::F highest = V::pick(found.back, found.highest[1], found.highest[0]);
  const V::F lowest = V::pick(found.back, found.lowest[1], found.lowest[0]);
  const V::F other = V::pick(found.back, found.lowest[0], found.lowest[1]);
  const V::F lift = V::pick(V::lt(highest, other), V::most(highest, zero),
                            V::pick(V::lt(lowest, other), lowest, zero));
  V::store(crossings.apart.data() + walk.first, found.nearest);
  V::store(crossings.lift.data() + walk.first, lift);
  V::store(crossings.back.data() + walk.first, V::pick(found.back, V::all(1u), V::all(0u)));
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

CATOPTRIC_TARGET void crossAll(Walk walk, const NodeRange& nodes, float boxes,
                               OwnCrossings& crossings) {
  for (; walk.first < walk.packet.count; walk.first += V::kLanes) {
    const std::size_t count = std::min(V::kLanes, walk.packet.count - walk.first);
    const KindBits kinds = kindsOf(walk);
    const V::I own = V::load(walk.packet.own.data() + walk.first);
    const unsigned lanes = ~0u >> (32 - count) & ~V::bits(V::le(own, V::all(0u)));
    const Kind kind = kinds.of(0);
    if ((kinds.like(0) & lanes) == lanes)
      crossLanes<false>(walk, kind, lanes, nodes, boxes, crossings);
    else
      crossLanes<true>(walk, {}, lanes, nodes, boxes, crossings);
  }
}
