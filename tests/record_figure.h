#pragma once

#include <gtest/gtest.h>

#include <sstream>
#include <string>

namespace radbake::tests {

/// Records a measured figure in a test's XML or JSON output (--gtest_output=json:FILE), where tests/docs has them from.
inline void record_figure(const std::string& name, double value) {
  std::ostringstream out;
  out << value;
  testing::Test::RecordProperty(name, out.str());
}

}  // namespace radbake::tests
