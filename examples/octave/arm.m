% The impedance of an arm from six recordings, which `ndof study arm` makes.
% ANCHOR: response
trials = arrayfun(@(k) sprintf('ndof-out/arm/recordings/arm-%d.csv', k), 1:6, 'UniformOutput', false);
estimated = ndof('estimate', trials{:}, '--nperseg', '2048', '--band', '0.25-15');
compliance = estimated.derived.re + 1i * estimated.derived.im;    % m/N, output by input by frequency
[~, k] = min(abs(estimated.frequency_hz - 1));
interval = estimated.derived.gain_ci95(1, 1, k, :);
fprintf('%.2f Hz, x to x: %.3f mm/N, 95 %% from %.3f to %.3f\n', estimated.frequency_hz(k), 1e3 * abs(compliance(1, 1, k)), 1e3 * interval);
% ANCHOR_END: response
% ANCHOR: fit
fitted = ndof('fit', trials{:}, '--nperseg', '2048', '--band', '0.5-8', '--kinematics', 'examples/kinematics/right_arm.toml');
for p = fitted.parameters'
  fprintf('%s %8.2f %s, 95 %% from %.2f to %.2f\n', p.name, p.value, p.unit, p.ci95);
end
fprintf('stiffness of shoulder and elbow, N m/rad:\n');
disp(fitted.joint.K);
% ANCHOR_END: fit
