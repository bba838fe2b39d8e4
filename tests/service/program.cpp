#include "tests/service/program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <utility>

#include "common/base/version.h"

namespace radbake::testing {

Program::Program(std::vector<std::string> arguments) {
  int ends[2];
  EXPECT_EQ(pipe2(ends, O_CLOEXEC), 0);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  arguments.insert(arguments.begin(), RADBAKE_RADBAKED);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  EXPECT_EQ(posix_spawn(&pid_, RADBAKE_RADBAKED, &actions, nullptr, argv.data(), environ), 0);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  output_ = fdopen(ends[0], "r");
}

Program::~Program() {
  if (pid_ > 0) end(SIGKILL);
  fclose(output_);
}

std::string Program::wait_for_address() {
  char line[4096];
  const std::string start = std::string("radbaked ") + kEngineVersion + " listening on ";
  while (fgets(line, sizeof(line), output_)) {
    output_text_ += line;
    const std::string text = line;
    if (text.starts_with(start)) return text.substr(start.size(), text.size() - start.size() - 1);
  }
  return "";
}

int Program::wait() {
  char line[4096];
  while (fgets(line, sizeof(line), output_)) output_text_ += line;
  int status = 0;
  waitpid(std::exchange(pid_, 0), &status, 0);
  return status;
}

int Program::end(int signal) {
  kill(pid_, signal);
  return wait();
}

}  // namespace radbake::testing
