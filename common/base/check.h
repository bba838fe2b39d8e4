#pragma once

#include <sstream>
#include <string>

namespace radbake {

/// Prints the failed condition with its values to stderr and aborts. For programmer errors only.
[[noreturn]] void check_failed(const char* file, int line, const char* condition, const std::string& values);

template <typename A, typename B>
std::string describe_values(const A& a, const B& b) {
  std::ostringstream out;
  out.precision(17);
  out << a << " against " << b;
  return out.str();
}

}  // namespace radbake

/// Aborts with the values of both sides when a precondition that only a programmer can break does not hold.
#define RADBAKE_CHECK(condition)                                                   \
  do {                                                                             \
    if (!(condition)) ::radbake::check_failed(__FILE__, __LINE__, #condition, ""); \
  } while (false)
#define RADBAKE_CHECK_OP(a, op, b)                                               \
  do {                                                                           \
    const auto& radbake_a = (a);                                                 \
    const auto& radbake_b = (b);                                                 \
    if (!(radbake_a op radbake_b))                                               \
      ::radbake::check_failed(__FILE__, __LINE__, #a " " #op " " #b,             \
                              ::radbake::describe_values(radbake_a, radbake_b)); \
  } while (false)
#define RADBAKE_CHECK_EQ(a, b) RADBAKE_CHECK_OP(a, ==, b)
#define RADBAKE_CHECK_LT(a, b) RADBAKE_CHECK_OP(a, <, b)
#define RADBAKE_CHECK_LE(a, b) RADBAKE_CHECK_OP(a, <=, b)
