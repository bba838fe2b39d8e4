#pragma once

#include <string>

namespace radbake::testing {

/// What an admin port answers.
struct AdminPage {
  int status = 0;  ///< 0: nobody answers
  std::string text;
};

/// GET http://ADDRESS/PATH.
AdminPage get_page(const std::string& address, const std::string& path);

/// The value of a metric, written as it stands there: name or name{label="value"}. NaN if it is not there.
double metric(const std::string& page, const std::string& name);

}  // namespace radbake::testing
