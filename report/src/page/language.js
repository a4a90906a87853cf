// Under the locale POSIX some browsers name a language that their own number format refuses; uPlot would stop at it.
try {
  new Intl.NumberFormat(navigator.language);
} catch {
  Object.defineProperty(navigator, 'language', {value: 'en-US'});
}
