#include "estimator.h"

#include <esim/geometry/so3.h>

#include <Eigen/LU>
#include <utility>

namespace {

// Index of the first component of each error.
constexpr int kPosition = 0, kVelocity = 3, kRotation = 6, kGyroscope = 9, kAccelerometer = 12;

}  // namespace

Estimator::Estimator(const esim::SE3& T_world_body, const esim::ImuOptions& imu)
    : imu_(imu), T_world_body_(T_world_body) {
  const auto variance = [](double sigma) { return Eigen::Vector3d::Constant(sigma * sigma); };
  Eigen::Matrix<double, 15, 1> diagonal;
  diagonal << variance(0.02), variance(0.01), variance(0.02), variance(0.02), variance(0.1);
  P_ = diagonal.asDiagonal();
}

void Estimator::predict(const esim::ImuRecord& measurement) {
  const double h = esim::to_seconds(measurement.t - last_.t);
  const esim::ImuRecord before = last_;
  last_ = measurement;
  if (!std::exchange(started_, true)) return;

  // The state, by the mean of two measurements.
  const Eigen::Vector3d omega =
      (before.measured.angular_rate + measurement.measured.angular_rate) / 2 - bias_.angular_rate;
  const Eigen::Vector3d force =
      (before.measured.specific_force + measurement.measured.specific_force) / 2 - bias_.specific_force;
  const Eigen::Matrix3d R = (T_world_body_.rotation * esim::so3_exp(h / 2 * omega)).toRotationMatrix();
  const Eigen::Vector3d acceleration = R * force + imu_.gravity;
  T_world_body_.translation += h * velocity_ + h * h / 2 * acceleration;
  velocity_ += h * acceleration;
  T_world_body_.rotation = (T_world_body_.rotation * esim::so3_exp(h * omega)).normalized();

  // Its errors.
  Covariance F = Covariance::Identity();
  F.block<3, 3>(kPosition, kVelocity) = h * Eigen::Matrix3d::Identity();
  F.block<3, 3>(kVelocity, kRotation) = -h * R * esim::hat(force);
  F.block<3, 3>(kVelocity, kAccelerometer) = -h * R;
  F.block<3, 3>(kRotation, kRotation) = esim::so3_exp(-h * omega).toRotationMatrix();
  F.block<3, 3>(kRotation, kGyroscope) = -h * Eigen::Matrix3d::Identity();
  P_ = F * P_ * F.transpose();
  const auto add_noise = [&](int error, double density) {
    P_.diagonal().segment<3>(error).array() += density * density * h;
  };
  add_noise(kVelocity, imu_.accelerometer.noise_density);
  add_noise(kRotation, imu_.gyroscope.noise_density);
  add_noise(kGyroscope, imu_.gyroscope.random_walk);
  add_noise(kAccelerometer, imu_.accelerometer.random_walk);
}

void Estimator::correct(const Eigen::Vector3d& position, double sigma_m) {
  const Eigen::Matrix3d S = P_.block<3, 3>(kPosition, kPosition) + sigma_m * sigma_m * Eigen::Matrix3d::Identity();
  const Eigen::Matrix<double, 15, 3> gain = P_.middleCols<3>(kPosition) * S.inverse();
  const Eigen::Matrix<double, 15, 1> error = gain * (position - T_world_body_.translation);
  P_ -= gain * P_.middleRows<3>(kPosition).eval();
  P_ = ((P_ + P_.transpose()) / 2).eval();

  T_world_body_.translation += error.segment<3>(kPosition);
  velocity_ += error.segment<3>(kVelocity);
  T_world_body_.rotation = (T_world_body_.rotation * esim::so3_exp(error.segment<3>(kRotation))).normalized();
  bias_.angular_rate += error.segment<3>(kGyroscope);
  bias_.specific_force += error.segment<3>(kAccelerometer);
}
