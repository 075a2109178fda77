/* MuJoCo's multibody under forces at the feet that are computed here, from the equations of docs/body.md: what remains of
 * a difference to hal-sim is then neither the law of the feet nor MuJoCo's contact.
 *
 *     feet MODEL.xml FREQUENCY STEP SECONDS SAMPLE [NORMAL_K NORMAL_CHI SHEAR_K SHEAR_D [EXPONENT EXCESS SPEED]]
 *
 * Frequency in Hz, counter-clockwise positive; step, length and time between two samples in s. With the feet's four numbers
 * (N/m, s/m, N/m, N·s/m) the ground is the plane z = 0; without them the robot touches nothing. Radius and friction of every
 * foot are those of the model's geoms `foot…`; MuJoCo's own contacts are switched off. Three numbers more make another law
 * than hal-sim's: a spring that grows with a power of its depth, as a sphere's does with 3/2, as stiff as the other one under
 * an eighth of the weight; and friction that is higher at rest by a share, which falls with the speed (m/s) of sliding.
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
  /* Power of the depth, and the depth at which the spring is that of the power 1, m. */
  double exponent, usual_depth;
  /* Friction's excess at rest, a share, and the speed over which it falls, m/s. */
  double excess, speed;
} Law;

/* A foot: its sphere in the model, and how far its rubber is sheared along the ground, m. */
typedef struct {
  int geom;
  double shear[2];
} Foot;

static void fail(const char *what) {
  fprintf(stderr, "feet: %s\n", what);
  exit(1);
}

/* The force of the ground on a foot whose lowest point is `depth` below it and moves by `velocity`, and the shear a step
 * later. Spring and damper in parallel along the ground; when together they would exceed what the load lets the foot bear,
 * the foot slides, and the spring gives way as fast as the damper lets it: ds/dt = -(f + k s)/d in either case. */
static void ground_force(const Law *law, double friction, double depth, const double velocity[3], double step,
                         double shear[2], double force[3]) {
  memset(force, 0, 3 * sizeof(double));
  if (depth <= 0.0) {
    shear[0] = shear[1] = 0.0;
    return;
  }
  double spring = law->normal_k * depth * pow(depth / law->usual_depth, law->exponent - 1.0);
  double load = spring * (1.0 - law->normal_chi * velocity[2]);
  force[2] = load > 0.0 ? load : 0.0;
  for (int i = 0; i < 2; i++) force[i] = -law->shear_k * shear[i] - law->shear_d * velocity[i];
  double sliding = hypot(velocity[0], velocity[1]) / law->speed;
  double wanted = hypot(force[0], force[1]), bears = friction * (1.0 + law->excess * exp(-sliding * sliding)) * force[2];
  if (wanted > bears) {
    force[0] *= bears / wanted;
    force[1] *= bears / wanted;
  }
  for (int i = 0; i < 2; i++) shear[i] -= step * (force[i] + law->shear_k * shear[i]) / law->shear_d;
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
    double force[3], torque[3];
    ground_force(law, m->geom_friction[3 * geom], radius - centre[2], velocity, m->opt.timestep, feet[i].shear, force);
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
    if (name && strncmp(name, "foot", 4) == 0) feet[count++] = (Foot){.geom = geom};
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
  if (count != 6 && count != 10 && count != 13)
    fail("MODEL FREQUENCY STEP SECONDS SAMPLE [NORMAL_K NORMAL_CHI SHEAR_K SHEAR_D [EXPONENT EXCESS SPEED]]");
  double number[13] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1.0, 0.0, 1.0};
  for (int i = 2; i < count; i++) number[i] = strtod(words[i], NULL);
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
  double usual_depth = number[6] > 0.0 ? weight / (8.0 * number[6]) : 1.0;
  Law law = {number[6], number[7], number[8], number[9], number[10], usual_depth, number[11], number[12]};
  Foot feet[MOST_FEET];
  int standing = count >= 10 ? find_feet(m, feet) : 0, shown = modules(m, sites);

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
