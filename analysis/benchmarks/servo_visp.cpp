// The paper's slide as one writes it with ViSP 3: the peer of servo.py, which compiles and runs it.
//
// ViSP has no latency and no feed-forward: past images are kept in a buffer, and L^+ ds*/dt is added
// to its control law. It works in normalised image coordinates, which is the same law where
// Fx = Fy. Reads numbers from standard input: frames, latency in frames, period, gain, feed-forward
// gain, T* (6), oTc at the start (16), number of points, points (3 each). Prints the time of the
// second of two equal runs in s, then oTc of every frame, 16 numbers a line.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <vector>

#if !__has_include(<visp3/vs/vpServo.h>)
#error "ViSP is not installed"
#endif
#include <visp3/core/vpExponentialMap.h>
#include <visp3/core/vpPoint.h>
#include <visp3/robot/vpSimulatorCamera.h>
#include <visp3/visual_features/vpFeaturePoint.h>
#include <visp3/vs/vpServo.h>

struct Experiment {
  unsigned int frames, late;
  double period, lambda, forward;
  vpColVector twist;          // T*, constant
  vpHomogeneousMatrix start;  // oTc
  std::vector<vpPoint> points;
};

typedef std::vector<vpFeaturePoint> Image;

static Image look(const vpHomogeneousMatrix &oMc, std::vector<vpPoint> &points)
{
  const vpHomogeneousMatrix cMo = oMc.inverse();
  Image image(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    points[i].track(cMo);
    image[i].buildFrom(points[i].get_x(), points[i].get_y(), points[i].get_Z());
  }
  return image;
}

static std::vector<vpHomogeneousMatrix> run(const Experiment &experiment)
{
  std::vector<vpPoint> points = experiment.points;
  vpSimulatorCamera robot;
  robot.setSamplingTime(experiment.period);
  robot.setMaxTranslationVelocity(10.0);  // not to be limited
  robot.setMaxRotationVelocity(10.0);
  robot.setPosition(experiment.start);

  Image measured(points.size()), wanted(points.size());
  vpServo task;
  task.setServo(vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(vpServo::CURRENT, vpServo::PSEUDO_INVERSE);
  task.setLambda(experiment.lambda);
  for (size_t i = 0; i < points.size(); ++i)
    task.addFeature(measured[i], wanted[i]);

  std::vector<Image> seen;
  std::vector<vpHomogeneousMatrix> poses;
  vpColVector rate(2 * static_cast<unsigned int>(points.size()));
  for (unsigned int k = 0; k <= experiment.frames; ++k) {
    const vpHomogeneousMatrix oMc = robot.getPosition();
    poses.push_back(oMc);
    seen.push_back(look(oMc, points));
    const Image &old = seen[k - std::min(k, experiment.late)];
    const vpHomogeneousMatrix moved =
      vpExponentialMap::direct(experiment.twist, k * experiment.period);
    const Image reference = look(experiment.start * moved, points);
    for (unsigned int i = 0; i < points.size(); ++i) {
      measured[i].buildFrom(old[i].get_x(), old[i].get_y(), old[i].get_Z());
      wanted[i].buildFrom(reference[i].get_x(), reference[i].get_y(), reference[i].get_Z());
      const vpColVector ds = wanted[i].interaction() * experiment.twist;
      rate[2 * i] = ds[0];
      rate[2 * i + 1] = ds[1];
    }
    const vpColVector feedback = task.computeControlLaw();
    const vpColVector v =
      feedback + task.getTaskJacobianPseudoInverse() * rate * experiment.forward;
    robot.setVelocity(vpRobot::CAMERA_FRAME, v);
  }
  return poses;
}

int main()
{
  Experiment experiment;
  size_t count;
  std::cin >> experiment.frames >> experiment.late >> experiment.period >> experiment.lambda >>
    experiment.forward;
  experiment.twist.resize(6);
  for (unsigned int i = 0; i < 6; ++i)
    std::cin >> experiment.twist[i];
  for (unsigned int i = 0; i < 4; ++i)
    for (unsigned int j = 0; j < 4; ++j)
      std::cin >> experiment.start[i][j];
  std::cin >> count;
  for (size_t i = 0; i < count; ++i) {
    double x, y, z;
    std::cin >> x >> y >> z;
    experiment.points.push_back(vpPoint(x, y, z));
  }
  if (!std::cin)
    return 2;

  run(experiment);
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<vpHomogeneousMatrix> poses = run(experiment);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;

  std::printf("%.9g\n", taken.count());
  for (const vpHomogeneousMatrix &pose : poses) {
    for (unsigned int i = 0; i < 16; ++i)
      std::printf("%.17g ", pose[i / 4][i % 4]);
    std::printf("\n");
  }
  return 0;
}
