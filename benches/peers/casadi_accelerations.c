/* The time of the accelerations from CasADi's M and f at one state: both evaluated, then a dense Cholesky solve. */

#include <time.h>

#define SIZE 50

/* What CasADi generated: q and v in; M, dense by columns, and f out. */
int equations(const double **arg, double **res, long long *iw, double *w, int mem);

typedef void dposv(char *uplo, int *n, int *nrhs, double *a, int *lda, double *b, int *ldb, int *info);

/* Solves in place; M = L Lᵀ in the lower triangle by columns, which are the rows of the upper one. */
static void cholesky_solve(double *restrict m, double *restrict b) {
  for (int j = 0; j < SIZE; ++j) {
    double *restrict row = m + SIZE * j;
    const double scale = 1.0 / __builtin_sqrt(row[j]);
    for (int i = j; i < SIZE; ++i) row[i] *= scale;
    for (int k = j + 1; k < SIZE; ++k) {
      double *restrict rest = m + SIZE * k;
      const double factor = row[k];
      for (int i = k; i < SIZE; ++i) rest[i] -= factor * row[i];
    }
    b[j] *= scale;
    for (int i = j + 1; i < SIZE; ++i) b[i] -= b[j] * row[i];
  }
  for (int j = SIZE; j-- > 0;) {
    double sum = b[j];
    for (int i = j + 1; i < SIZE; ++i) sum -= m[SIZE * j + i] * b[i];
    b[j] = sum / m[SIZE * j + j];
  }
}

/* Seconds a call; the accelerations are left in `result`. Without LAPACK's solver the one above is used. */
double accelerations(const double *q, const double *v, double *work, long long *integers, long calls, dposv *lapack,
                     double *result) {
  double matrix[SIZE * SIZE];
  const double *arg[16] = {q, v};
  double *res[16] = {matrix, result};
  struct timespec start, end;
  clock_gettime(CLOCK_MONOTONIC, &start);
  for (long call = 0; call < calls; ++call) {
    equations(arg, res, integers, work, 0);
    if (lapack) {
      int size = SIZE, one = 1, info;
      lapack("L", &size, &one, matrix, &size, result, &size, &info);
    } else {
      cholesky_solve(matrix, result);
    }
    __asm__ volatile("" : : "r"(result) : "memory");
  }
  clock_gettime(CLOCK_MONOTONIC, &end);
  return ((double)(end.tv_sec - start.tv_sec) + 1e-9 * (double)(end.tv_nsec - start.tv_nsec)) / (double)calls;
}
