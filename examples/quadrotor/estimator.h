#pragma once

#include <esim/imu/options.h>
#include <esim/recording/record.h>

/// An error-state Kalman filter of pose, velocity and the IMU's biases: predicts with every measurement of the IMU and
/// corrects with positions. Its errors, in order: position and velocity (world frame), rotation (body frame,
/// R_true = R Exp(error)), bias of the gyroscope, bias of the accelerometer.
class Estimator {
 public:
  /// The initial pose is well known, the biases are not. The IMU's frame is the body's.
  Estimator(const esim::SE3& T_world_body, const esim::ImuOptions& imu);

  void predict(const esim::ImuRecord& measurement);
  void correct(const Eigen::Vector3d& position, double sigma_m);

  const esim::SE3& pose() const { return T_world_body_; }
  const Eigen::Vector3d& velocity() const { return velocity_; }
  esim::TimeNs time() const { return last_.t; }

 private:
  using Covariance = Eigen::Matrix<double, 15, 15>;

  esim::ImuOptions imu_;
  esim::SE3 T_world_body_;
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
  esim::InertialSignals bias_;
  Covariance P_;
  esim::ImuRecord last_;
  bool started_ = false;
};
