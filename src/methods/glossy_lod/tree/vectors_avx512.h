// Vectors of 16 for walk.h: included by traversal.cpp alone, in a namespace.
// NOLINT(llvm-header-guard)
struct V {
  static constexpr std::size_t kLanes = 16;
  using F = __m512;
  using I = __m512i;
  using M = __mmask16;
#define CATOPTRIC_OP CATOPTRIC_TARGET [[gnu::always_inline]] static inline
  CATOPTRIC_OP F all(float x) {
    return _mm512_set1_ps(x);
  }
  CATOPTRIC_OP I all(std::uint32_t x) {
    return _mm512_set1_epi32(static_cast<int>(x));
  }
  CATOPTRIC_OP F load(const float* p) {
    return _mm512_loadu_ps(p);
  }
  CATOPTRIC_OP void store(float* p, F x) {
    _mm512_storeu_ps(p, x);
  }
  CATOPTRIC_OP void store(std::uint32_t* p, I x) {
    _mm512_storeu_si512(p, x);
  }
  CATOPTRIC_OP F add(F a, F b) {
    return _mm512_add_ps(a, b);
  }
  CATOPTRIC_OP F sub(F a, F b) {
    return _mm512_sub_ps(a, b);
  }
  CATOPTRIC_OP F mul(F a, F b) {
    return _mm512_mul_ps(a, b);
  }
  CATOPTRIC_OP F div(F a, F b) {
    return _mm512_div_ps(a, b);
  }
  CATOPTRIC_OP F root(F a) {
    return _mm512_sqrt_ps(a);
  }
  CATOPTRIC_OP F least(F a, F b) {
    return _mm512_min_ps(a, b);
  }
  CATOPTRIC_OP F most(F a, F b) {
    return _mm512_max_ps(a, b);
  }
  CATOPTRIC_OP F magnitude(F a) {
    return _mm512_abs_ps(a);
  }
  CATOPTRIC_OP M le(F a, F b) {
    return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ);
  }
  CATOPTRIC_OP M lt(F a, F b) {
    return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ);
  }
  CATOPTRIC_OP M le(I a, I b) {
    return _mm512_cmple_epi32_mask(a, b);
  }
  CATOPTRIC_OP M both(M a, M b) {
    return static_cast<M>(a & b);
  }
  CATOPTRIC_OP M either(M a, M b) {
    return static_cast<M>(a | b);
  }
  CATOPTRIC_OP M without(M a, M b) {
    return static_cast<M>(a & ~b);
  }
  CATOPTRIC_OP unsigned bits(M a) {
    return a;
  }
  CATOPTRIC_OP M fromBits(unsigned a) {
    return static_cast<M>(a);
  }
  CATOPTRIC_OP F pick(M m, F yes, F no) {
    return _mm512_mask_blend_ps(m, no, yes);
  }
  CATOPTRIC_OP I pick(M m, I yes, I no) {
    return _mm512_mask_blend_epi32(m, no, yes);
  }
#undef CATOPTRIC_OP
};
