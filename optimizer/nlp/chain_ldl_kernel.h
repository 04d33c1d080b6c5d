#pragma once
/// Dense inner loops of ChainLdl, compiled for the baseline and for AVX2 and chosen at run time. Private to ChainLdl.
/// All columns are padded: a loop may read and write up to kLdlPadding entries beyond a column's last row.
namespace sparflow::detail {

// no threshold: width of the widest loop
inline constexpr int kLdlPadding = 8;
/// Rows rounded up to whole vectors.
inline int ldl_padded(int rows) { return (rows + 3) / 4 * 4; }
inline int ldl_stride(int rows) { return ldl_padded(rows + kLdlPadding); }

struct LdlKernel {
  /// Largest |column[i]|, 0 <= i < size; the padding up to whole vectors must be zero.
  double (*largest)(int size, const double* column);
  /// f(i, c) -= l1[i] w1[c] (+ l2[i] w2[c] when l2 is given) for first <= c < last, c <= i < size.
  void (*update)(double* f, int stride, int first, int last, int size, const double* l1,
                 const double* w1, const double* l2, const double* w2);
  /// f(i, c) -= sum_k l(i, k) w(c, k) for first <= c <= i < size, k < count; all three with the same stride.
  void (*product)(double* f, int stride, int first, int size, const double* l, const double* w,
                  int count);
  /// x -= L x column by column (unit lower panel, zeros above and on its diagonal), `stride` a multiple of four
  void (*forward)(int stride, int count, const double* panel, double* x);
  /// x -= L^T x, last column first
  void (*backward)(int stride, int count, const double* panel, double* x);
};

const LdlKernel& ldl_kernel();

}  // namespace sparflow::detail
