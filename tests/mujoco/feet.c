/* MuJoCo's multibody under forces at the feet that are computed here, from the equations of docs/body.md: what remains of
 * a difference to hal-sim is then neither the law of the feet nor MuJoCo's contact.
 *
 *     feet MODEL.xml FREQUENCY STEP SECONDS SAMPLE [KEY=VALUE…]
 *
 * Frequency in Hz, counter-clockwise positive; step, length and time between two samples in s. Without further words the robot
 * touches nothing; with the four numbers of the feet, normal_k (N/m), normal_chi (s/m), shear_k (N/m) and shear_d (N·s/m), the
 * ground is the plane z = 0. Radius and friction of every foot are those of the model's geoms `foot…`; MuJoCo's own contacts are
 * switched off. What makes another law of it:
 *
 *     exponent        power of the depth with which a foot's load grows: 3/2 for a sphere; as stiff as the linear spring under
 *                     an eighth of the weight
 *     excess, speed   friction is higher at rest by a share, which falls with the speed (m/s) of sliding as exp(−(v/speed)²)
 *     tanh_excess     the same, falling as 1/cosh(v/speed)
 *     load_exponent   friction's coefficient falls with this power of the load, and is the model's under an eighth of the weight
 *     lateral         friction across a module as a share of that along it
 *     bristles        friction against moving ahead is lower by this share, against moving back higher
 *     adhesion        a foot that touches is held down by so much, N, and bears that much more friction
 *     ripple, ripple_length   the ground is a wave along x: its height and length, m
 *     stripes         every other 10 mm along x have friction lower by this share, the others higher
 *     creep           friction grows with the speed of sliding: by this share at 0.1 m/s
 *
 * Prints one JSON object: `modules`, for every sample from the start on the centres of all modules, m.
 */

#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_FEET = 128, MOST_MODULES = 64 };

/* The law's numbers. */
typedef struct {
  double normal_k, normal_chi, shear_k, shear_d;
  double exponent, excess, tanh_excess, speed, load_exponent, lateral, bristles, adhesion, ripple, ripple_length, stripes, creep;
  /* A foot's share of the weight, N, and how deep it sinks under it with the linear spring, m. */
  double usual_load, usual_depth;
} Law;

/* Reads KEY=VALUE. */
static int read_word(Law *law, const char *word) {
  const struct {
    const char *key;
    double *value;
  } known[] = {
      {"normal_k", &law->normal_k},       {"normal_chi", &law->normal_chi}, {"shear_k", &law->shear_k},
      {"shear_d", &law->shear_d},         {"exponent", &law->exponent},     {"excess", &law->excess},
      {"tanh_excess", &law->tanh_excess}, {"speed", &law->speed},           {"load_exponent", &law->load_exponent},
      {"lateral", &law->lateral},         {"bristles", &law->bristles},     {"adhesion", &law->adhesion},
      {"ripple", &law->ripple},           {"ripple_length", &law->ripple_length},
      {"stripes", &law->stripes},         {"creep", &law->creep},
  };
  for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
    size_t length = strlen(known[i].key);
    if (strncmp(word, known[i].key, length) == 0 && word[length] == '=') {
      *known[i].value = strtod(word + length + 1, NULL);
      return 1;
    }
  }
  return 0;
}

/* A foot: its sphere in the model, that of its module's other foot (or -1), whether it is the left one, and how far its rubber is
 * sheared along the ground, m. */
typedef struct {
  int geom, other, left;
  double shear[2];
} Foot;

static void fail(const char *what) {
  fprintf(stderr, "feet: %s\n", what);
  exit(1);
}

/* Coefficient of friction of a foot at x that slides by `velocity` under a load, its module's front being `ahead`. */
static double coefficient(const Law *law, double friction, double x, const double velocity[2], double load, const double ahead[2]) {
  double speed = hypot(velocity[0], velocity[1]), sliding = speed / law->speed;
  double factor = 1.0 + law->excess * exp(-sliding * sliding) + law->tanh_excess / cosh(sliding) + law->creep * speed / 0.1;
  factor *= fmin(pow(fmax(load, 1e-12) / law->usual_load, -law->load_exponent), 3.0);
  if (speed > 0.0) factor *= 1.0 - law->bristles * (velocity[0] * ahead[0] + velocity[1] * ahead[1]) / speed;
  factor *= 1.0 + (fmod(floor(x / 0.01), 2.0) == 0.0 ? -law->stripes : law->stripes);
  return friction * factor;
}

/* The force of the ground on a foot at x whose lowest point is `depth` below it and moves by `velocity`, and the shear a step
 * later. Spring and damper in parallel along the ground; when together they would exceed what the load lets the foot bear,
 * the foot slides, and the spring gives way as fast as the damper lets it: ds/dt = -(f + k s)/d in either case. */
static void ground_force(const Law *law, double friction, double x, double depth, const double velocity[3], const double ahead[2],
                         double step, double shear[2], double force[3]) {
  memset(force, 0, 3 * sizeof(double));
  if (depth <= 0.0) {
    shear[0] = shear[1] = 0.0;
    return;
  }
  double spring = law->normal_k * depth * pow(depth / law->usual_depth, law->exponent - 1.0);
  double load = spring * (1.0 - law->normal_chi * velocity[2]);
  load = load > 0.0 ? load : 0.0;
  force[2] = load - law->adhesion;
  for (int i = 0; i < 2; i++) force[i] = -law->shear_k * shear[i] - law->shear_d * velocity[i];
  double along = force[0] * ahead[0] + force[1] * ahead[1], across = force[1] * ahead[0] - force[0] * ahead[1];
  double wanted = hypot(along, across / law->lateral);
  double bears = coefficient(law, friction, x, velocity, load, ahead) * load;
  if (wanted > bears) {
    force[0] *= bears / wanted;
    force[1] *= bears / wanted;
  }
  for (int i = 0; i < 2; i++) shear[i] -= step * (force[i] + law->shear_k * shear[i]) / law->shear_d;
}

/* Where a foot's module looks along the ground: its left foot lies to the left. */
static void looks(const mjData *d, const Foot *foot, double ahead[2]) {
  ahead[0] = 1.0, ahead[1] = 0.0;
  if (foot->other < 0) return;
  const double *here = d->geom_xpos + 3 * foot->geom, *there = d->geom_xpos + 3 * foot->other;
  double sign = foot->left ? 1.0 : -1.0, x = sign * (here[0] - there[0]), y = sign * (here[1] - there[1]);
  double length = hypot(x, y);
  if (length > 0.0) ahead[0] = y / length, ahead[1] = -x / length;
}

/* Puts the ground's forces on the bodies, between mj_step1 and mj_step2. */
static void stand(const mjModel *m, mjData *d, const Law *law, Foot *feet, int count) {
  mju_zero(d->xfrc_applied, 6 * m->nbody);
  for (int i = 0; i < count; i++) {
    int geom = feet[i].geom, body = m->geom_bodyid[geom];
    double radius = m->geom_size[3 * geom];
    const double *centre = d->geom_xpos + 3 * geom;
    double moving[6]; /* Angular, then linear. */
    mj_objectVelocity(m, d, mjOBJ_GEOM, geom, moving, 0);
    /* Of the sphere's lowest point: angular velocity times the way down to it, and the centre's velocity. */
    double velocity[3] = {moving[3] - radius * moving[1], moving[4] + radius * moving[0], moving[5]};
    double force[3], torque[3], ahead[2];
    looks(d, &feet[i], ahead);
    double height = law->ripple * sin(2.0 * mjPI * centre[0] / law->ripple_length);
    ground_force(law, m->geom_friction[3 * geom], centre[0], radius + height - centre[2], velocity, ahead, m->opt.timestep,
                 feet[i].shear, force);
    double arm[3] = {centre[0], centre[1], centre[2] - radius};
    mju_subFrom3(arm, d->xipos + 3 * body);
    mju_cross(torque, arm, force);
    mju_addTo3(d->xfrc_applied + 6 * body, force);
    mju_addTo3(d->xfrc_applied + 6 * body + 3, torque);
  }
}

/* The sites module1, module2, … */
static int modules(const mjModel *m, int sites[MOST_MODULES]) {
  int count = 0;
  char name[32];
  for (; count < MOST_MODULES; count++) {
    snprintf(name, sizeof name, "module%d", count + 1);
    int site = mj_name2id(m, mjOBJ_SITE, name);
    if (site < 0) break;
    sites[count] = site;
  }
  return count;
}

static int find_feet(const mjModel *m, Foot feet[MOST_FEET]) {
  int count = 0;
  for (int geom = 0; geom < m->ngeom && count < MOST_FEET; geom++) {
    const char *name = mj_id2name(m, mjOBJ_GEOM, geom);
    if (!name || strncmp(name, "foot", 4) != 0) continue;
    /* foot1L and foot1R are a pair. */
    char other[64];
    size_t last = strlen(name) - 1;
    snprintf(other, sizeof other, "%s", name);
    int left = name[last] == 'L';
    if (last < sizeof other) other[last] = left ? 'R' : 'L';
    feet[count++] = (Foot){.geom = geom, .other = mj_name2id(m, mjOBJ_GEOM, other), .left = left};
  }
  return count;
}

static void print_sample(const mjData *d, const int *sites, int count, int first) {
  printf(first ? "[" : ",[");
  for (int i = 0; i < count; i++) {
    const double *at = d->site_xpos + 3 * sites[i];
    printf("%s[%.17g,%.17g,%.17g]", i ? "," : "", at[0], at[1], at[2]);
  }
  printf("]");
}

int main(int count, char **words) {
  if (count < 6) fail("MODEL FREQUENCY STEP SECONDS SAMPLE [KEY=VALUE...]");
  double number[6] = {0};
  for (int i = 2; i < 6; i++) number[i] = strtod(words[i], NULL);
  Law law = {.exponent = 1.0, .speed = 1.0, .lateral = 1.0, .ripple_length = 1.0};
  for (int i = 6; i < count; i++)
    if (!read_word(&law, words[i])) fail(words[i]);
  char error[500] = "";
  mjModel *m = mj_loadXML(words[1], NULL, error, sizeof error);
  if (!m) fail(error);
  m->opt.timestep = number[3];
  m->opt.disableflags |= mjDSBL_CONTACT;
  mjData *d = mj_makeData(m);

  int rotor = mj_name2id(m, mjOBJ_JOINT, "rotor"), sites[MOST_MODULES];
  if (rotor < 0) fail("the model has no rotor");
  double speed = 2.0 * mjPI * number[2];
  d->qvel[m->jnt_dofadr[rotor]] = speed;
  /* The servo aims ahead of the phase by what its damping holds back. */
  double ahead = -m->actuator_biasprm[2] / m->actuator_gainprm[0];
  double weight = mj_getTotalmass(m) * mju_norm3(m->opt.gravity);
  law.usual_load = weight / 8.0;
  law.usual_depth = law.normal_k > 0.0 ? law.usual_load / law.normal_k : 1.0;
  Foot feet[MOST_FEET];
  int standing = law.normal_k > 0.0 ? find_feet(m, feet) : 0, shown = modules(m, sites);

  long steps = lround(number[4] / number[3]), every = lround(number[5] / number[3]);
  printf("{\"modules\":[");
  for (long step = 0; step <= steps; step++) {
    d->ctrl[0] = speed * ((double)step * m->opt.timestep + ahead);
    mj_step1(m, d);
    if (step % every == 0) print_sample(d, sites, shown, step == 0);
    stand(m, d, &law, feet, standing);
    mj_step2(m, d);
  }
  printf("]}\n");
  mj_deleteData(d);
  mj_deleteModel(m);
  return 0;
}
