#pragma once

#include <gtest/gtest.h>

#include <string>

namespace esim::test {

/// The message of the `Expected` exception that body() throws; "nothing was thrown" otherwise. Other exceptions pass.
template <typename Expected, typename Body>
std::string message_of(const Body& body) {
  try {
    body();
  } catch (const Expected& error) {
    return error.what();
  }
  return "nothing was thrown";
}

inline testing::AssertionResult contains(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "\"" << text << "\" does not contain \"" << part << "\"";
}

}  // namespace esim::test
