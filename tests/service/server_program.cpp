#include "tests/service/server_program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <utility>

#include "common/base/version.h"

namespace radbake::testing {

ServerProgram::ServerProgram(std::vector<std::string> arguments, const std::vector<std::string>& environment) {
  int ends[2];
  EXPECT_EQ(pipe2(ends, O_CLOEXEC), 0);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  arguments.insert(arguments.begin(), RADBAKE_RADBAKED);
  std::vector<char*> argv, env;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  for (const std::string& variable : environment) env.push_back(const_cast<char*>(variable.c_str()));
  for (char** variable = environ; *variable != nullptr; ++variable) env.push_back(*variable);
  env.push_back(nullptr);
  EXPECT_EQ(posix_spawn(&pid_, RADBAKE_RADBAKED, &actions, nullptr, argv.data(), env.data()), 0);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  output_ = fdopen(ends[0], "r");
}

ServerProgram::~ServerProgram() {
  if (pid_ > 0) end(SIGKILL);
  fclose(output_);
}

std::string ServerProgram::wait_for_address() {
  return wait_for(std::string("radbaked ") + kEngineVersion + " listening on ");
}

std::string ServerProgram::wait_for(const std::string& text) {
  char buffer[4096];
  while (fgets(buffer, sizeof(buffer), output_)) {
    output_text_ += buffer;
    std::string line = buffer;
    const std::size_t at = line.find(text);
    if (at == std::string::npos) continue;
    line.erase(0, at + text.size());
    if (!line.empty() && line.back() == '\n') line.pop_back();
    return line;
  }
  return "";
}

int ServerProgram::wait() {
  char line[4096];
  while (fgets(line, sizeof(line), output_)) output_text_ += line;
  int status = 0;
  waitpid(std::exchange(pid_, 0), &status, 0);
  return status;
}

void ServerProgram::send(int signal) const { kill(pid_, signal); }

int ServerProgram::end(int signal) {
  send(signal);
  return wait();
}

}  // namespace radbake::testing
