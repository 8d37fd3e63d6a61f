#pragma once

#include <stdexcept>
#include <string>

namespace esim {

/// Base of everything the library throws. The message is one line: what is wrong, where, what to do.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The input or the environment is at fault (bad file, bad value, full disk): the user can repair it.
class UserError : public Error {
 public:
  using Error::Error;
};

/// An output could not be written, for example because the disk is full.
class OutputError : public UserError {
 public:
  using UserError::UserError;
};

/// The program is at fault: a contract between two modules was broken.
class InternalError : public Error {
 public:
  using Error::Error;
};

}  // namespace esim
