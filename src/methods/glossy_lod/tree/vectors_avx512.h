// Vectors of 2 x 16 lanes for walk.h; two vectors hide each other's latency. Only traversal.cpp
// includes this file, in a namespace. NOLINT(llvm-header-guard)
struct V {
  static constexpr std::size_t kLanes = 32;
  struct F {
    __m512 a, b;
  };
  struct I {
    __m512i a, b;
  };
  struct M {
    __mmask16 a, b;
  };
  CATOPTRIC_OP F all(float x) {
    const __m512 v = _mm512_set1_ps(x);
    return {v, v};
  }
  CATOPTRIC_OP I all(std::uint32_t x) {
    const __m512i v = _mm512_set1_epi32(static_cast<int>(x));
    return {v, v};
  }
  CATOPTRIC_OP F load(const float* p) { return {_mm512_loadu_ps(p), _mm512_loadu_ps(p + 16)}; }
  CATOPTRIC_OP I load(const std::uint32_t* p) {
    return {_mm512_loadu_si512(p), _mm512_loadu_si512(p + 16)};
  }
  CATOPTRIC_OP void store(float* p, F x) {
    _mm512_storeu_ps(p, x.a);
    _mm512_storeu_ps(p + 16, x.b);
  }
  CATOPTRIC_OP void store(std::uint32_t* p, I x) {
    _mm512_storeu_si512(p, x.a);
    _mm512_storeu_si512(p + 16, x.b);
  }
  CATOPTRIC_OP F add(F x, F y) { return {_mm512_add_ps(x.a, y.a), _mm512_add_ps(x.b, y.b)}; }
  CATOPTRIC_OP F sub(F x, F y) { return {_mm512_sub_ps(x.a, y.a), _mm512_sub_ps(x.b, y.b)}; }
  CATOPTRIC_OP F mul(F x, F y) { return {_mm512_mul_ps(x.a, y.a), _mm512_mul_ps(x.b, y.b)}; }
  CATOPTRIC_OP F div(F x, F y) { return {_mm512_div_ps(x.a, y.a), _mm512_div_ps(x.b, y.b)}; }
  CATOPTRIC_OP F root(F x) { return {_mm512_sqrt_ps(x.a), _mm512_sqrt_ps(x.b)}; }
  CATOPTRIC_OP F least(F x, F y) { return {_mm512_min_ps(x.a, y.a), _mm512_min_ps(x.b, y.b)}; }
  CATOPTRIC_OP F most(F x, F y) { return {_mm512_max_ps(x.a, y.a), _mm512_max_ps(x.b, y.b)}; }
  CATOPTRIC_OP F magnitude(F x) { return {_mm512_abs_ps(x.a), _mm512_abs_ps(x.b)}; }
  CATOPTRIC_OP M le(F x, F y) {
    return {_mm512_cmp_ps_mask(x.a, y.a, _CMP_LE_OQ), _mm512_cmp_ps_mask(x.b, y.b, _CMP_LE_OQ)};
  }
  CATOPTRIC_OP M lt(F x, F y) {
    return {_mm512_cmp_ps_mask(x.a, y.a, _CMP_LT_OQ), _mm512_cmp_ps_mask(x.b, y.b, _CMP_LT_OQ)};
  }
  CATOPTRIC_OP M le(I x, I y) {
    return {_mm512_cmple_epi32_mask(x.a, y.a), _mm512_cmple_epi32_mask(x.b, y.b)};
  }
  CATOPTRIC_OP M both(M x, M y) {
    return {static_cast<__mmask16>(x.a & y.a), static_cast<__mmask16>(x.b & y.b)};
  }
  CATOPTRIC_OP M either(M x, M y) {
    return {static_cast<__mmask16>(x.a | y.a), static_cast<__mmask16>(x.b | y.b)};
  }
  CATOPTRIC_OP M without(M x, M y) {
    return {static_cast<__mmask16>(x.a & ~y.a), static_cast<__mmask16>(x.b & ~y.b)};
  }
  CATOPTRIC_OP unsigned bits(M x) { return x.a | static_cast<unsigned>(x.b) << 16; }
  CATOPTRIC_OP M fromBits(unsigned x) {
    return {static_cast<__mmask16>(x), static_cast<__mmask16>(x >> 16)};
  }
  CATOPTRIC_OP F pick(M m, F yes, F no) {
    return {_mm512_mask_blend_ps(m.a, no.a, yes.a), _mm512_mask_blend_ps(m.b, no.b, yes.b)};
  }
  CATOPTRIC_OP I pick(M m, I yes, I no) {
    return {_mm512_mask_blend_epi32(m.a, no.a, yes.a), _mm512_mask_blend_epi32(m.b, no.b, yes.b)};
  }
};
