function result = ndof(varargin)
  % RESULT = NDOF('fit', 'trial.csv', '--band', '0.5-8') runs the program ndof and returns its result as a struct.
  %
  % The arguments are those of the command line. GNU Octave 7 or newer, MATLAB R2016b or newer; ndof must be on the PATH.
  file = [tempname() '.json'];
  arguments = sprintf(' "%s"', varargin{:}, '--json', file, '--quiet');
  status = system(['ndof' arguments]);
  if status ~= 0
    error('ndof:failed', 'ndof%s ended with %d; its message stands above', arguments, status);
  end
  result = jsondecode(fileread(file));
  delete(file);
end
