#pragma once

#include <stdexcept>
#include <string>

namespace esim::inline core {

/// Base of all exceptions of the library. The message is one line: what is wrong, where, and what to do.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An error of the input or the environment (bad file, bad value, full disk), which the user can correct.
class UserError : public Error {
 public:
  using Error::Error;
};

/// An output could not be written, for example because the disk is full.
class OutputError : public UserError {
 public:
  using UserError::UserError;
};

/// An error of the program: a contract between two modules was broken.
class InternalError : public Error {
 public:
  using Error::Error;
};

}  // namespace esim::inline core
