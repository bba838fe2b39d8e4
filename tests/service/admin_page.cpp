#include "tests/service/admin_page.h"

#include <httplib.h>

#include <cmath>
#include <sstream>

namespace radbake::testing {

AdminPage get_page(const std::string& address, const std::string& path) {
  httplib::Client client("http://" + address);
  const auto answer = client.Get(path);
  return answer ? AdminPage{answer->status, answer->body} : AdminPage{};
}

double metric(const std::string& page, const std::string& name) {
  std::istringstream lines(page);
  std::string line;
  while (std::getline(lines, line)) {
    if (line.starts_with(name + " ")) return std::stod(line.substr(name.size() + 1));
  }
  return std::nan("");
}

}  // namespace radbake::testing
